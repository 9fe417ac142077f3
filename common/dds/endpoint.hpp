#pragma once

#include "common/dds/participant.hpp"
#include "common/dds/topic.hpp"
#include "common/time.hpp"

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

namespace eprosima::fastdds::dds {
class DataReader;
class DataWriter;
class TopicDataType;
}  // namespace eprosima::fastdds::dds

namespace breakshot::dds {

/// The part of a writer that does not depend on the type of what it writes.
class WriterBase {
 public:
  /// Number of readers that discovery has matched. Says nothing about whether they get data: use an application handshake for that.
  int matched() const noexcept;

  WriterBase(const WriterBase&) = delete;
  WriterBase& operator=(const WriterBase&) = delete;
  WriterBase(WriterBase&&) = delete;
  WriterBase& operator=(WriterBase&&) = delete;

 protected:
  WriterBase(Participant& participant, const std::string& topic, Profile profile, eprosima::fastdds::dds::TopicDataType* type);
  ~WriterBase();
  bool write_wire(void* sample) noexcept;

 private:
  Participant& participant_;
  eprosima::fastdds::dds::DataWriter* writer_ = nullptr;
};

/// Publishes values of type T on Topic<T>. Thread-safe. Never call it from a real-time thread: DDS locks and may block.
template <typename T>
class Writer : public WriterBase {
 public:
  /// @param topic  another name than the type's own, for types that several topics share
  explicit Writer(Participant& participant, const std::string& topic = Topic<T>::kName)
      : WriterBase(participant, topic, Topic<T>::kProfile, new typename Topic<T>::WireSupport{}) {}

  /// @return false when DDS refused the sample (a full reliable history, typically)
  bool write(const T& value) noexcept {
    const std::lock_guard lock{mutex_};
    Topic<T>::encode(value, *wire_);
    return write_wire(wire_.get());
  }

 private:
  std::mutex mutex_;
  // Kept between writes: image samples are megabytes, and strings and sequences keep their capacity.
  std::unique_ptr<typename Topic<T>::Wire> wire_ = std::make_unique<typename Topic<T>::Wire>();
};

/// The part of a reader that does not depend on the type of what it reads.
class ReaderBase {
 public:
  virtual ~ReaderBase();
  int matched() const noexcept;
  /// Samples that decode() refused since the start; each kind is logged, at a bounded rate.
  std::uint64_t rejected() const noexcept { return rejected_.load(std::memory_order_relaxed); }

  ReaderBase(const ReaderBase&) = delete;
  ReaderBase& operator=(const ReaderBase&) = delete;
  ReaderBase(ReaderBase&&) = delete;
  ReaderBase& operator=(ReaderBase&&) = delete;

 protected:
  ReaderBase(Participant& participant, std::string topic, Profile profile, eprosima::fastdds::dds::TopicDataType* type);
  /// Joins the topic. From here on on_data() is called on DDS threads, never twice at a time. Each subclass's constructor calls it last.
  void enable();
  /// No call of on_data() runs or starts after this returns. Each subclass's destructor calls it first.
  void disable() noexcept;
  virtual void on_data() = 0;
  /// Takes one sample into `sample`; false when there is none. Skips samples without data.
  bool take_wire(void* sample) noexcept;
  void reject(const Invalid& why) noexcept;
  const std::string& topic() const noexcept { return topic_; }

 private:
  class Listener;
  void notify() noexcept;

  Participant& participant_;
  std::string topic_;
  std::unique_ptr<Listener> listener_;
  std::atomic<int> pending_{0};  // announcements that on_data() has not covered yet; non-zero while a thread is in it
  std::atomic<bool> closed_{false};
  eprosima::fastdds::dds::DataReader* reader_ = nullptr;
  std::atomic<std::uint64_t> rejected_{0};
};

/// Hands every valid sample of Topic<T> to a handler, on a DDS thread: the handler must be short, must not throw and must not call DDS
/// functions that wait. Use it to fill a lock-free slot or to enqueue.
template <typename T>
class Subscription final : public ReaderBase {
 public:
  using Handler = std::function<void(T&&)>;
  Subscription(Participant& participant, Handler handler, const std::string& topic = Topic<T>::kName)
      : ReaderBase(participant, topic, Topic<T>::kProfile, new typename Topic<T>::WireSupport{}), handler_{std::move(handler)} {
    enable();
  }
  ~Subscription() override { disable(); }

 private:
  void on_data() override {
    while (take_wire(wire_.get())) {
      auto value = Topic<T>::decode(*wire_);
      if (value) {
        handler_(std::move(*value));
      } else {
        reject(value.error());
      }
    }
  }

  std::unique_ptr<typename Topic<T>::Wire> wire_ = std::make_unique<typename Topic<T>::Wire>();
  Handler handler_;
};

/// Lets a thread of the caller's own wait for samples of Topic<T> and take them one by one, oldest first.
template <typename T>
class Reader final : public ReaderBase {
 public:
  explicit Reader(Participant& participant, const std::string& topic = Topic<T>::kName)
      : ReaderBase(participant, topic, Topic<T>::kProfile, new typename Topic<T>::WireSupport{}) {
    enable();
  }
  ~Reader() override { disable(); }

  /// Puts the next valid sample into `out`; waits for one at most `timeout`. @return false when none came or wake() was called
  bool take(T& out, Duration timeout = Duration::zero()) {
    const auto deadline = std::chrono::steady_clock::now() + timeout;
    while (true) {
      while (take_wire(wire_.get())) {
        auto value = Topic<T>::decode(*wire_);
        if (value) {
          out = std::move(*value);
          return true;
        }
        reject(value.error());
      }
      std::unique_lock lock{mutex_};
      if (!arrived_.wait_until(lock, deadline, [&] { return pending_ || woken_; })) return false;
      pending_ = false;
      if (std::exchange(woken_, false)) return false;
    }
  }

  /// Ends a take() that waits in another thread (for shutdown).
  void wake() {
    const std::lock_guard lock{mutex_};
    woken_ = true;
    arrived_.notify_all();
  }

 private:
  void on_data() override {
    const std::lock_guard lock{mutex_};
    pending_ = true;
    arrived_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable arrived_;
  bool pending_ = false;
  bool woken_ = false;
  std::unique_ptr<typename Topic<T>::Wire> wire_ = std::make_unique<typename Topic<T>::Wire>();
};

}  // namespace breakshot::dds
