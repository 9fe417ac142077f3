#include "sim_bridge/camera/gl_objects.hpp"

#include "sim_bridge/camera/camera_settings.hpp"

#include <array>
#include <numeric>
#include <string>
#include <vector>

namespace breakshot::sim_bridge {
namespace {

GLuint compile(const char* name, GLenum stage, std::initializer_list<const char*> parts) {
  std::vector<const char*> sources{"#version 300 es\nprecision highp float;\nprecision highp int;\n"};
  sources.insert(sources.end(), parts.begin(), parts.end());
  const GLuint shader = glCreateShader(stage);
  glShaderSource(shader, static_cast<GLsizei>(sources.size()), sources.data(), nullptr);
  glCompileShader(shader);
  GLint compiled = GL_FALSE;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
  if (compiled == GL_FALSE) {
    std::array<char, 2048> log{};
    glGetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), nullptr, log.data());
    throw CameraError{std::string{"camera: the driver rejects the shader '"} + name + "': " + log.data()};
  }
  return shader;
}

}  // namespace

Program::Program(const char* name, std::initializer_list<const char*> vertex_parts, std::initializer_list<const char*> fragment_parts)
    : id_{glCreateProgram()} {
  glAttachShader(id_, compile(name, GL_VERTEX_SHADER, vertex_parts));
  glAttachShader(id_, compile(name, GL_FRAGMENT_SHADER, fragment_parts));
  glLinkProgram(id_);
  GLint linked = GL_FALSE;
  glGetProgramiv(id_, GL_LINK_STATUS, &linked);
  if (linked == GL_FALSE) {
    std::array<char, 2048> log{};
    glGetProgramInfoLog(id_, static_cast<GLsizei>(log.size()), nullptr, log.data());
    throw CameraError{std::string{"camera: the driver cannot link the shaders '"} + name + "': " + log.data()};
  }
}

VertexStream::VertexStream(std::initializer_list<int> floats_per_attribute) {
  glGenVertexArrays(1, &array_);
  glGenBuffers(1, &vertices_);
  glGenBuffers(1, &indices_);
  glBindVertexArray(array_);
  glBindBuffer(GL_ARRAY_BUFFER, vertices_);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices_);
  const int stride = std::accumulate(floats_per_attribute.begin(), floats_per_attribute.end(), 0) * static_cast<int>(sizeof(float));
  GLuint location = 0;
  std::uintptr_t offset = 0;
  for (const int count : floats_per_attribute) {
    glEnableVertexAttribArray(location);
    // GL takes the offset into the buffer in the shape of a pointer.
    glVertexAttribPointer(location, count, GL_FLOAT, GL_FALSE, stride, reinterpret_cast<const void*>(offset));  // NOLINT
    ++location;
    offset += static_cast<std::uintptr_t>(count) * sizeof(float);
  }
}

void VertexStream::upload_vertices(const void* vertices, std::size_t bytes) const {
  glBindVertexArray(array_);
  glBindBuffer(GL_ARRAY_BUFFER, vertices_);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(bytes), vertices, GL_STREAM_DRAW);
}

void VertexStream::draw(std::size_t vertices) const {
  if (vertices == 0) return;
  glBindVertexArray(array_);
  glDrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(vertices));
}

void VertexStream::draw_indexed(std::size_t indices) const {
  if (indices == 0) return;
  glBindVertexArray(array_);
  glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(indices), GL_UNSIGNED_INT, nullptr);
}

Target::Target(int width, int height, std::initializer_list<GLenum> colour_formats, bool with_depth_buffer)
    : width_{width}, height_{height} {
  glGenFramebuffers(1, &framebuffer_);
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
  const auto attach = [&](GLenum format, GLenum attachment) {
    GLuint renderbuffer = 0;
    glGenRenderbuffers(1, &renderbuffer);
    glBindRenderbuffer(GL_RENDERBUFFER, renderbuffer);
    glRenderbufferStorage(GL_RENDERBUFFER, format, width, height);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, attachment, GL_RENDERBUFFER, renderbuffer);
  };
  std::vector<GLenum> attachments;
  for (const GLenum format : colour_formats) {
    attachments.push_back(GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(attachments.size()));
    attach(format, attachments.back());
  }
  if (with_depth_buffer) attach(GL_DEPTH_COMPONENT24, GL_DEPTH_ATTACHMENT);
  glDrawBuffers(static_cast<GLsizei>(attachments.size()), attachments.data());
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
    throw CameraError{"camera: the GL driver cannot render an image of " + std::to_string(width) + " x " + std::to_string(height) + " px"};
  }
}

void Target::bind() const {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
  glViewport(0, 0, width_, height_);
}

void check_gl(const char* where) {
  const GLenum error = glGetError();
  if (error == GL_NO_ERROR) return;
  const char* name = error == GL_OUT_OF_MEMORY       ? "out of memory"
                     : error == GL_INVALID_OPERATION ? "invalid operation"
                     : error == GL_INVALID_VALUE     ? "invalid value"
                     : error == GL_INVALID_ENUM      ? "invalid enum"
                                                     : "error";
  throw CameraError{std::string{"camera: GL: "} + name + " (" + std::to_string(error) + ") while " + where};
}

}  // namespace breakshot::sim_bridge
