#pragma once

#include <cstddef>
#include <type_traits>

namespace breakshot::rt {

/// True for types whose copy stays within the object: no heap, no lock, no reference to anything outside. All trivially copyable types are;
/// a type with fixed-capacity Eigen members is too, but the language cannot tell: its owner says so by a specialisation.
template <typename T>
inline constexpr bool kSelfContained = std::is_trivially_copyable_v<T>;

/// Separates what two threads write, so that they do not steal each other's cache line. 64 on x86-64 and on the ARM cores of interest
/// (std::hardware_destructive_interference_size is not stable across compilers, and GCC warns of it).
inline constexpr std::size_t kCacheLine = 64;

}  // namespace breakshot::rt
