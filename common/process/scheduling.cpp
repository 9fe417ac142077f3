#include "common/process/scheduling.hpp"

#include <pthread.h>
#include <sched.h>

namespace breakshot::process {

InheritedFifo::InheritedFifo(int priority) noexcept {
  sched_param before{};
  if (pthread_getschedparam(pthread_self(), &policy_, &before) != 0) return;
  priority_ = before.sched_priority;
  sched_param wanted{};
  wanted.sched_priority = priority;
  changed_ = pthread_setschedparam(pthread_self(), SCHED_FIFO, &wanted) == 0;
}

InheritedFifo::~InheritedFifo() {
  if (!changed_) return;
  sched_param before{};
  before.sched_priority = priority_;
  pthread_setschedparam(pthread_self(), policy_, &before);
}

void limit_thread_stacks(unsigned long bytes) noexcept {
  pthread_attr_t attributes;
  if (pthread_attr_init(&attributes) != 0) return;
  if (pthread_attr_setstacksize(&attributes, bytes) == 0) pthread_setattr_default_np(&attributes);
  pthread_attr_destroy(&attributes);
}

}  // namespace breakshot::process
