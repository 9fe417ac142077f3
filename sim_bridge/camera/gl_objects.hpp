#pragma once

#include "common/geometry.hpp"

#include <GLES3/gl3.h>

#include <array>
#include <initializer_list>
#include <string>

namespace breakshot::sim_bridge {

// GL objects die with their context, which lives exactly as long as the renderer that made them; so these wrappers only make and use.

/// A linked program. @throws CameraError with the compiler's log
class Program {
 public:
  Program(const char* name, std::initializer_list<const char*> vertex_parts, std::initializer_list<const char*> fragment_parts);

  void use() const { glUseProgram(id_); }
  /// Location of a uniform; -1 (which GL ignores) when the program does not use it.
  GLint uniform(const char* name) const { return glGetUniformLocation(id_, name); }

  void set(const char* name, int value) const { glUniform1i(uniform(name), value); }
  void set(const char* name, double value) const { glUniform1f(uniform(name), static_cast<float>(value)); }
  void set(const char* name, const Vector2& value) const {
    glUniform2f(uniform(name), static_cast<float>(value.x()), static_cast<float>(value.y()));
  }
  void set(const char* name, const Vector3& value) const {
    glUniform3f(uniform(name), static_cast<float>(value.x()), static_cast<float>(value.y()), static_cast<float>(value.z()));
  }
  void set(const char* name, const Matrix3& value) const;

 private:
  GLuint id_;
};

/// One attribute of a vertex: how many floats.
/// A buffer of interleaved float vertices (and, optionally, indices) that is refilled every frame.
class VertexStream {
 public:
  explicit VertexStream(std::initializer_list<int> floats_per_attribute);

  /// @param bytes size of the vertices
  void upload(const void* vertices, std::size_t bytes) const;
  void upload_indices(const void* indices, std::size_t bytes) const;
  void bind() const { glBindVertexArray(array_); }

 private:
  GLuint array_ = 0, vertices_ = 0, indices_ = 0;
};

/// A texture to render into. @throws CameraError when the driver cannot render to it
struct Target {
  Target(int width, int height, std::initializer_list<GLenum> colour_formats, bool with_depth_buffer);
  void bind() const { glBindFramebuffer(GL_FRAMEBUFFER, framebuffer); }
  GLuint framebuffer = 0;
};

/// @throws CameraError when GL has recorded an error since the last check
void check_gl(const char* where);

}  // namespace breakshot::sim_bridge
