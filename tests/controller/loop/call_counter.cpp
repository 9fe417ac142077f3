#include "tests/controller/loop/call_counter.hpp"

#include <dlfcn.h>
#include <pthread.h>

#include <cerrno>
#include <cstddef>

namespace breakshot::control::test {

namespace {

thread_local bool counting = false;
thread_local CallCounts counts;

}  // namespace

void start_counting() noexcept {
  counts = {};
  counting = true;
}

CallCounts stop_counting() noexcept {
  counting = false;
  return counts;
}

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)

bool counting_works() noexcept { return false; }

#else

bool counting_works() noexcept { return true; }

namespace {

void count_heap() noexcept {
  if (counting) ++counts.heap;
}

void count_mutex() noexcept {
  if (counting) ++counts.mutexes;
}

template <typename Function>
Function next(const char* name) noexcept {
  void* found = dlsym(RTLD_NEXT, name);
  Function function = nullptr;
  static_assert(sizeof function == sizeof found);
  __builtin_memcpy(&function, &found, sizeof function);  // ISO C++ has no cast from object to function pointer
  return function;
}

}  // namespace

#endif

}  // namespace breakshot::control::test

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)

// glibc's own entry points, so that nothing has to be looked up before the heap works.
extern "C" {
void* __libc_malloc(std::size_t) noexcept;
void* __libc_calloc(std::size_t, std::size_t) noexcept;
void* __libc_realloc(void*, std::size_t) noexcept;
void* __libc_memalign(std::size_t, std::size_t) noexcept;
void __libc_free(void*) noexcept;

using breakshot::control::test::count_heap;
using breakshot::control::test::count_mutex;
using breakshot::control::test::next;

void* malloc(std::size_t size) noexcept {
  count_heap();
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) noexcept {
  count_heap();
  return __libc_calloc(count, size);
}
void* realloc(void* block, std::size_t size) noexcept {
  count_heap();
  return __libc_realloc(block, size);
}
void free(void* block) noexcept {
  count_heap();
  __libc_free(block);
}
void* memalign(std::size_t alignment, std::size_t size) noexcept {
  count_heap();
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  count_heap();
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** block, std::size_t alignment, std::size_t size) noexcept {
  count_heap();
  *block = __libc_memalign(alignment, size);
  return *block == nullptr ? ENOMEM : 0;
}

int pthread_mutex_lock(pthread_mutex_t* mutex) noexcept {
  static const auto real = next<int (*)(pthread_mutex_t*)>("pthread_mutex_lock");
  count_mutex();
  return real(mutex);
}
int pthread_mutex_trylock(pthread_mutex_t* mutex) noexcept {
  static const auto real = next<int (*)(pthread_mutex_t*)>("pthread_mutex_trylock");
  count_mutex();
  return real(mutex);
}
int pthread_mutex_unlock(pthread_mutex_t* mutex) noexcept {
  static const auto real = next<int (*)(pthread_mutex_t*)>("pthread_mutex_unlock");
  count_mutex();
  return real(mutex);
}
}

#endif
