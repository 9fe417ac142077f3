#pragma once

#include "common/geometry.hpp"

#include <GLES3/gl3.h>

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <vector>

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

 private:
  GLuint id_;
};

/// A buffer of interleaved float vertices, and indices if wanted, that is refilled every frame.
class VertexStream {
 public:
  VertexStream(std::initializer_list<int> floats_per_attribute);

  template <typename Vertex>
  void upload(const std::vector<Vertex>& vertices) const {
    upload_vertices(vertices.data(), vertices.size() * sizeof(Vertex));
  }
  template <typename Vertex>
  void upload(const std::vector<Vertex>& vertices, const std::vector<std::uint32_t>& indices) const {
    upload(vertices);
    glBufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(indices.size() * sizeof(std::uint32_t)), indices.data(), GL_STREAM_DRAW);
  }

  /// Draw triangles with the program in use; nothing when the count is 0.
  void draw(std::size_t vertices) const;
  void draw_indexed(std::size_t indices) const;

 private:
  void upload_vertices(const void* vertices, std::size_t bytes) const;

  GLuint array_ = 0, vertices_ = 0, indices_ = 0;
};

/// Images to render into, one or two of colour and perhaps one of depth. @throws CameraError when the driver cannot
class Target {
 public:
  Target(int width, int height, std::initializer_list<GLenum> colour_formats, bool with_depth_buffer);

  /// Draws and reads go here from now on.
  void bind() const;

 private:
  int width_, height_;
  GLuint framebuffer_ = 0;
};

/// @throws CameraError when GL has recorded an error since the last check
void check_gl(const char* where);

}  // namespace breakshot::sim_bridge
