#include "sim_bridge/camera/headless_context.hpp"

#include "sim_bridge/camera/camera_settings.hpp"

#include <EGL/egl.h>
#include <EGL/eglext.h>

#include <array>
#include <cstdlib>
#include <mutex>
#include <string>
#include <string_view>

namespace breakshot::sim_bridge {
namespace {

constexpr const char* kWhatToInstall =
    "; rendering needs Mesa's EGL with a software driver: apt-get install libegl1 libegl-mesa0 libgles2 libgl1-mesa-dri";

std::string egl_error_name() {
  const EGLint error = eglGetError();
  switch (error) {
    case EGL_SUCCESS: return "no further reason";
    case EGL_NOT_INITIALIZED: return "EGL_NOT_INITIALIZED";
    case EGL_BAD_ACCESS: return "EGL_BAD_ACCESS";
    case EGL_BAD_ALLOC: return "EGL_BAD_ALLOC";
    case EGL_BAD_ATTRIBUTE: return "EGL_BAD_ATTRIBUTE";
    case EGL_BAD_CONFIG: return "EGL_BAD_CONFIG";
    case EGL_BAD_CONTEXT: return "EGL_BAD_CONTEXT";
    case EGL_BAD_MATCH: return "EGL_BAD_MATCH";
    case EGL_BAD_PARAMETER: return "EGL_BAD_PARAMETER";
    default: return "EGL error " + std::to_string(error);
  }
}

[[noreturn]] void fail(const std::string& what) { throw CameraError{"camera: " + what + kWhatToInstall}; }

/// EGL separates the names of extensions by blanks; a name may be the prefix of another.
bool lists(const char* extensions, std::string_view name) {
  std::string padded{" "};
  padded.append(extensions != nullptr ? extensions : "").append(" ");
  std::string wanted{" "};
  wanted.append(name).append(" ");
  return padded.find(wanted) != std::string::npos;
}

}  // namespace

/// EGL has one display per process and platform, and terminating it ends every context on it; so it is shared and counted.
class HeadlessContext::Display {
 public:
  static std::shared_ptr<Display> acquire() {
    static std::mutex mutex;
    static std::weak_ptr<Display> shared;
    const std::lock_guard lock{mutex};
    auto display = shared.lock();
    if (!display) {
      display = std::make_shared<Display>();
      shared = display;
    }
    return display;
  }

  Display() {
    // llvmpipe starts a thread per core unless told otherwise. Rendering inside the calling thread costs the least CPU time per frame
    // (measured: see camera.hpp), and the cell needs its other core. Whoever sets the variable wins.
    setenv("LP_NUM_THREADS", "0", 0);  // NOLINT(concurrency-mt-unsafe): documented at Camera's constructor

    if (!lists(eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS), "EGL_MESA_platform_surfaceless")) {
      fail("EGL has no surfaceless platform (EGL_MESA_platform_surfaceless)");
    }
    display_ = eglGetPlatformDisplay(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
    if (display_ == EGL_NO_DISPLAY) fail("eglGetPlatformDisplay(surfaceless): " + egl_error_name());
    if (eglInitialize(display_, nullptr, nullptr) == EGL_FALSE) fail("eglInitialize: " + egl_error_name());
    for (const char* needed : {"EGL_KHR_surfaceless_context", "EGL_KHR_no_config_context"}) {
      if (!lists(eglQueryString(display_, EGL_EXTENSIONS), needed)) fail(std::string{"the EGL driver lacks "} + needed);
    }
  }
  ~Display() { eglTerminate(display_); }
  Display(const Display&) = delete;
  Display& operator=(const Display&) = delete;

  EGLDisplay get() const { return display_; }

 private:
  EGLDisplay display_ = EGL_NO_DISPLAY;
};

HeadlessContext::HeadlessContext() : display_{Display::acquire()} {
  if (eglBindAPI(EGL_OPENGL_ES_API) == EGL_FALSE) fail("eglBindAPI(OpenGL ES): " + egl_error_name());
  constexpr std::array<EGLint, 5> kAttributes{EGL_CONTEXT_MAJOR_VERSION, 3, EGL_CONTEXT_MINOR_VERSION, 0, EGL_NONE};
  context_ = eglCreateContext(display_->get(), EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, kAttributes.data());
  if (context_ == EGL_NO_CONTEXT) fail("eglCreateContext(OpenGL ES 3.0): " + egl_error_name());
}

HeadlessContext::~HeadlessContext() { eglDestroyContext(display_->get(), context_); }

HeadlessContext::Current::Current(const HeadlessContext& context) : context_{context} {
  if (eglMakeCurrent(context.display_->get(), EGL_NO_SURFACE, EGL_NO_SURFACE, context.context_) == EGL_FALSE) {
    throw CameraError{"camera: eglMakeCurrent: " + egl_error_name() + "; one camera renders on one thread at a time"};
  }
}

HeadlessContext::Current::~Current() { eglMakeCurrent(context_.display_->get(), EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT); }

}  // namespace breakshot::sim_bridge
