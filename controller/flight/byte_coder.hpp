#pragma once

#include "common/joints.hpp"
#include "common/time.hpp"
#include "controller/safety/fail_safe.hpp"

#include <array>
#include <bit>
#include <concepts>
#include <cstdint>
#include <cstring>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>

// One description of the fields of a type (`fields(code, value)`, or a static member `fields(self, code)`) serves for writing and for reading.
// Numbers are stored little-endian in their own width, doubles bit for bit, so that a NaN comes back as the NaN that it was.

namespace breakshot::control::flight {

static_assert(std::endian::native == std::endian::little, "numbers are copied as they are");

/// A flight record that cannot be read; what() says why and where.
class RecordError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

template <typename T>
concept Number = std::is_arithmetic_v<T> && !std::same_as<std::remove_const_t<T>, bool>;

/// T is U, const or not: lets one template describe a type for writing and for reading.
template <typename T, typename U>
concept Is = std::same_as<std::remove_const_t<T>, U>;

class ByteWriter {
 public:
  const std::string& bytes() const noexcept { return bytes_; }

  template <typename... T>
  void operator()(const T&... values) {
    (put(values), ...);
  }
  /// An index or an enumerator, which a reader must be able to trust.
  template <typename T>
  void below(const T& value, std::uint64_t /*limit*/) {
    const auto number = static_cast<std::uint64_t>(value);
    put(number);
  }

 private:
  template <Number T>
  void put(const T& value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  void put(const bool& value) { put(static_cast<std::uint8_t>(value)); }
  void put(const Duration& value) { put(value.count()); }
  void put(const Time& value) { put(to_ns(value)); }
  void put(const safety::CauseSet& value) { put(value.bits()); }
  void put(const std::string& value) {
    put(static_cast<std::uint32_t>(value.size()));
    bytes_ += value;
  }
  void put(const JointVector& value) {
    put(static_cast<std::uint8_t>(value.size()));
    for (Eigen::Index i = 0; i < value.size(); ++i) put(value[i]);
  }
  template <typename T, std::size_t kSize>
  void put(const std::array<T, kSize>& values) {
    for (const T& value : values) put(value);
  }
  template <typename T>
  void put(const T& value) {
    if constexpr (requires { T::fields(value, *this); }) {
      T::fields(value, *this);
    } else {
      fields(*this, value);
    }
  }

  std::string bytes_;
};

/// Reads what ByteWriter wrote. @throws RecordError for bytes that are missing or are no such value
class ByteReader {
 public:
  explicit ByteReader(std::span<const char> bytes) noexcept : bytes_{bytes} {}

  std::size_t position() const noexcept { return position_; }
  std::size_t left() const noexcept { return bytes_.size() - position_; }

  template <typename... T>
  void operator()(T&... values) {
    (get(values), ...);
  }
  template <typename T>
  void below(T& value, std::uint64_t limit) {
    std::uint64_t number = 0;
    get(number);
    if (number >= limit) refuse("number " + std::to_string(number) + "; allowed: 0 to " + std::to_string(limit - 1));
    value = static_cast<T>(number);
  }
  [[noreturn]] void refuse(const std::string& what) const {
    throw RecordError("byte " + std::to_string(position_) + " of the contents: found " + what);
  }

 private:
  template <Number T>
  void get(T& value) {
    if (left() < sizeof value) refuse("the end; expected " + std::to_string(sizeof value) + " more bytes");
    std::memcpy(&value, bytes_.data() + position_, sizeof value);
    position_ += sizeof value;
  }
  void get(bool& value) {
    std::uint8_t byte = 0;
    get(byte);
    if (byte > 1) refuse("byte " + std::to_string(byte) + "; allowed: 0 or 1");
    value = byte != 0;
  }
  void get(Duration& value) {
    Duration::rep count = 0;
    get(count);
    value = Duration{count};
  }
  void get(Time& value) {
    std::int64_t ns = 0;
    get(ns);
    value = time_from_ns(ns);
  }
  void get(safety::CauseSet& value) {
    std::uint16_t bits = 0;
    get(bits);
    if (bits >> safety::kCauses != 0) refuse("a safety cause that this program does not know");
    value = safety::CauseSet{bits};
  }
  void get(std::string& value) {
    std::uint32_t size = 0;
    get(size);
    if (size > left()) refuse("a text of " + std::to_string(size) + " bytes; left are " + std::to_string(left()));
    value.assign(bytes_.data() + position_, size);
    position_ += size;
  }
  void get(JointVector& value) {
    std::uint8_t size = 0;
    get(size);
    if (size > kMaxJoints) refuse(std::to_string(size) + " joints; allowed: 0 to " + std::to_string(kMaxJoints));
    value.resize(size);
    for (Eigen::Index i = 0; i < value.size(); ++i) get(value[i]);
  }
  template <typename T, std::size_t kSize>
  void get(std::array<T, kSize>& values) {
    for (T& value : values) get(value);
  }
  template <typename T>
  void get(T& value) {
    if constexpr (requires { T::fields(value, *this); }) {
      T::fields(value, *this);
    } else {
      fields(*this, value);
    }
  }

  std::span<const char> bytes_;
  std::size_t position_ = 0;
};

}  // namespace breakshot::control::flight
