#include "common/urdf/urdf_lines.hpp"

#include "common/urdf/arm_description.hpp"

#include <tinyxml2.h>

#include <utility>

namespace breakshot::urdf_detail {

UrdfLines::UrdfLines(const std::string& text, std::string file) : file_{std::move(file)} {
  tinyxml2::XMLDocument document;
  if (document.Parse(text.c_str(), text.size()) != tinyxml2::XML_SUCCESS) {
    throw ArmDescriptionError{file_ + ":" + std::to_string(document.ErrorLineNum()) + ": found malformed XML (" + document.ErrorName() +
                              "); allowed: a URDF, XML with one <robot> element"};
  }
  const tinyxml2::XMLElement* const robot = document.RootElement();
  if (robot == nullptr || std::string_view{robot->Name()} != "robot") {
    throw ArmDescriptionError{file_ + ":" + std::to_string(robot == nullptr ? 1 : robot->GetLineNum()) + ": found " +
                              (robot == nullptr ? std::string{"no element"} : "<" + std::string{robot->Name()} + ">") +
                              " at the root; allowed: <robot>"};
  }
  for (const auto* element = robot->FirstChildElement(); element != nullptr; element = element->NextSiblingElement()) {
    const char* const name = element->Attribute("name");
    if (name == nullptr) continue;  // urdfdom refuses it
    const std::string kind = element->Name();
    if (kind == "link") add(links_, kind, name, element->GetLineNum());
    if (kind == "joint") {
      add(joints_, kind, name, element->GetLineNum());
      if (const auto* const limit = element->FirstChildElement("limit")) limits_.emplace(name, limit->GetLineNum());
    }
  }
}

void UrdfLines::add(Index& index, const std::string& kind, const std::string& name, int line) const {
  const auto [entry, added] = index.emplace(name, line);
  if (added) return;
  throw ArmDescriptionError{file_ + ":" + std::to_string(line) + ": " + kind + " " + name +
                            ": found the name a second time; allowed: each name once; the first is at line " +
                            std::to_string(entry->second)};
}

std::string UrdfLines::limit(std::string_view joint_name) const {
  return limits_.contains(joint_name) ? place(limits_, joint_name) : joint(joint_name);
}

std::string UrdfLines::mentioned(std::string_view message) const {
  // The longest name wins, so that "wrist_1_link" is not taken for "wrist_1".
  std::string_view best;
  std::string where = file_;
  for (const Index* index : {&joints_, &links_}) {
    for (const auto& [name, line] : *index) {
      if (name.size() > best.size() && message.find(name) != std::string_view::npos) {
        best = name;
        where = place(*index, name);
      }
    }
  }
  return where;
}

std::vector<std::string> UrdfLines::link_names() const {
  std::vector<std::string> names;
  for (const auto& entry : links_) names.push_back(entry.first);
  return names;
}

std::string UrdfLines::place(const Index& index, std::string_view name) const {
  const auto found = index.find(name);
  return found == index.end() ? file_ : file_ + ":" + std::to_string(found->second);
}

}  // namespace breakshot::urdf_detail
