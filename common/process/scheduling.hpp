#pragma once

namespace breakshot::process {

/// While it lives, the calling thread is SCHED_FIFO, and threads that are started meanwhile inherit it.
///
/// For threads of libraries that cannot be told: on a busy machine, a state or command that waits for a DDS receive thread is a late one. Create
/// the participant that carries them within the scope of such an object, and bulk traffic elsewhere. Without the right to real-time
/// scheduling nothing changes (whoever runs the real-time thread warns of that).
class InheritedFifo {
 public:
  /// @param priority  1 to 98: below the real-time thread's
  explicit InheritedFifo(int priority) noexcept;
  ~InheritedFifo();
  InheritedFifo(const InheritedFifo&) = delete;
  InheritedFifo& operator=(const InheritedFifo&) = delete;
  InheritedFifo(InheritedFifo&&) = delete;
  InheritedFifo& operator=(InheritedFifo&&) = delete;

 private:
  int policy_ = 0;
  int priority_ = 0;
  bool changed_ = false;
};

/// Stack size of threads that are started from now on. Locked memory is resident memory, and 8 MiB for each of a dozen library threads is a lot.
void limit_thread_stacks(unsigned long bytes) noexcept;

}  // namespace breakshot::process
