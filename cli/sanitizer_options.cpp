// What the address sanitizer is told in every program built with it.
#ifdef __SANITIZE_ADDRESS__

// The runtime of GCC 12 and 13 takes a block of thread-local storage of a library loaded late for one with a header of glibc 2.19
// when it happens to lie 16 bytes past a page (one in 256), and its search for leaks then reads at a wild address
// (github.com/google/sanitizers/issues/1322). Nothing is lost without: such blocks belong to the loader, and what it holds is searched.
extern "C" const char* __asan_default_options();
extern "C" const char* __asan_default_options() {
    return "intercept_tls_get_addr=0";
}

#endif
