#pragma once

// glibc 2.36 declares its pidfd functions without C linkage for C++ (put right in 2.37); wrapping is harmless where it does.
extern "C" {
#include <sys/pidfd.h>
}
