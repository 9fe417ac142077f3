#pragma once

// Private to common/urdf.

#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace breakshot::urdf_detail {

/// Where the elements of a URDF stand. urdfdom knows no line numbers, so the text is read a second time for them.
class UrdfLines {
 public:
  /// @throws ArmDescriptionError naming `file` and the line, when the text is no well-formed XML with a <robot> at its root, or names a link or a joint twice
  UrdfLines(const std::string& text, std::string file);

  /// "file:line" of <link name="..."> or <joint name="...">; just "file" for a name that is not there.
  std::string link(std::string_view name) const { return place(links_, name); }
  std::string joint(std::string_view name) const { return place(joints_, name); }
  /// "file:line" of a joint's <limit>, else of the joint.
  std::string limit(std::string_view joint_name) const;
  /// "file:line" of the element that a message of urdfdom speaks of, by the names that occur in it; else "file".
  std::string mentioned(std::string_view message) const;
  const std::string& file() const noexcept { return file_; }

  std::vector<std::string> link_names() const;

 private:
  using Index = std::map<std::string, int, std::less<>>;
  void add(Index& index, const std::string& kind, const std::string& name, int line) const;
  std::string place(const Index& index, std::string_view name) const;

  std::string file_;
  Index links_, joints_, limits_;
};

}  // namespace breakshot::urdf_detail
