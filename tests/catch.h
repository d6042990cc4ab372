#pragma once
// The one place that knows that Catch2 moved its headers between version 2 (Debian 12) and 3 (Debian 13).
#if CATCH2_MAJOR >= 3
#include <catch2/catch_all.hpp>
#else
#include <catch2/catch.hpp>
#endif
