#pragma once
/// Marks a function of plain loops that is compiled twice, with and without AVX2; the processor at hand chooses. The bits of its
/// results are the same: AVX2 alone fuses no multiplications with additions.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define NATUREL_WIDE __attribute__((target_clones("avx2", "default")))
#else
#define NATUREL_WIDE
#endif
