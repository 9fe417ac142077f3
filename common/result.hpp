#pragma once

#include <type_traits>
#include <utility>
#include <variant>

namespace breakshot {

/// Either what was asked for, or why not.
///
/// Never throws and never allocates by itself, so it serves on the real-time thread whenever T and E do. T and E must be
/// different types, so that a plain `return error;` is never ambiguous. Reading the side that is not there is a bug in the caller and
/// undefined, as with std::optional: test first.
template <typename T, typename E>
class [[nodiscard]] Result {
  static_assert(!std::is_same_v<T, E>, "a value and an error of one type cannot be told apart");

 public:
  // NOLINTBEGIN(google-explicit-constructor): a function returns its value or its error as it is
  constexpr Result(T value) noexcept(std::is_nothrow_move_constructible_v<T>) : state_{std::in_place_index<0>, std::move(value)} {}
  constexpr Result(E error) noexcept(std::is_nothrow_move_constructible_v<E>) : state_{std::in_place_index<1>, std::move(error)} {}
  // NOLINTEND(google-explicit-constructor)

  constexpr explicit operator bool() const noexcept { return state_.index() == 0; }

  constexpr const T& operator*() const& noexcept { return *std::get_if<0>(&state_); }
  constexpr T& operator*() & noexcept { return *std::get_if<0>(&state_); }
  constexpr T&& operator*() && noexcept { return std::move(*std::get_if<0>(&state_)); }
  constexpr const T* operator->() const noexcept { return std::get_if<0>(&state_); }
  constexpr T* operator->() noexcept { return std::get_if<0>(&state_); }

  constexpr const E& error() const noexcept { return *std::get_if<1>(&state_); }

 private:
  std::variant<T, E> state_;
};

/// The value of an operation that has nothing to return but success.
struct Ok {};

}  // namespace breakshot
