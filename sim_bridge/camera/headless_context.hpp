#pragma once

#include <memory>

namespace breakshot::sim_bridge {

/// An OpenGL ES 3.0 context without any window, on EGL's surfaceless platform (Mesa); software rendering is enough.
///
/// Several may live in one process; they share the EGL display and nothing else. The context is current on a thread only while a `Current`
/// lives there, so it belongs to no thread in between.
class HeadlessContext {
 public:
  /// @throws CameraError that says which step failed and which Debian packages to install
  HeadlessContext();
  ~HeadlessContext();
  HeadlessContext(const HeadlessContext&) = delete;
  HeadlessContext& operator=(const HeadlessContext&) = delete;

  /// Makes the context current on this thread for as long as it lives.
  class Current {
   public:
    /// @throws CameraError when the context is current on another thread
    explicit Current(const HeadlessContext& context);
    ~Current();
    Current(const Current&) = delete;
    Current& operator=(const Current&) = delete;

   private:
    const HeadlessContext& context_;
  };

 private:
  class Display;
  std::shared_ptr<Display> display_;
  void* context_ = nullptr;  ///< EGLContext
};

}  // namespace breakshot::sim_bridge
