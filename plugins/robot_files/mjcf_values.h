// SPDX-License-Identifier: Apache-2.0
// Attributes of MJCF elements: their own, or those of their class of defaults; orientations in the
// five notations under the compiler's settings; children with includes in their place (layer:
// plugin).
#pragma once

#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "documents.h"
#include "left_out.h"
#include "mechanism.h"

namespace robomosp::robot_files {

class MjcfValues {
 public:
  MjcfValues(Documents& documents, std::filesystem::path folder)
      : documents_(documents), folder_(std::move(folder)) {}

  /// The elements inside `e`, included files' in the place of their <include>.
  Result<std::vector<const Element*>> children(const Element& e) const;

  /// The settings of <compiler> that the notations need; later ones count.
  Result<void> compiler(const Element& e);
  /// A <default> of the model with the classes in it; unknown attributes of joints are reported.
  Result<void> defaults(const Element& top);

  /// Of the element or else the class around it. A class that is not there is an error at the end.
  std::string class_of(const Element& e, const std::string& around) const;
  /// The first element that named a class which is not there.
  [[nodiscard]] Result<void> check_classes() const;

  /// The attribute of the element, or of its class of defaults, or "".
  [[nodiscard]] std::string_view value(const Element& e, const std::string& cls,
                                       const char* attribute) const;
  /// Exactly out.size() numbers; unchanged where the attribute is not there.
  Result<void> list(const Element& e, const std::string& cls, const char* attribute,
                    std::span<double> out) const;
  /// The first number, as some attributes may have further ones.
  Result<double> first(const Element& e, const std::string& cls, const char* attribute,
                       double otherwise) const;
  Result<Colour> colour(const Element& e, const std::string& cls) const;
  /// pos with quat, axisangle, euler, xyaxes or zaxis. The element's own notation goes before its
  /// class's.
  Result<Pose> pose(const Element& e, const std::string& cls) const;
  [[nodiscard]] double angle(double v) const;  ///< as the file writes it -> [rad]
  [[nodiscard]] bool autolimits() const { return autolimits_; }

 private:
  using Attributes = std::map<std::string, std::string, std::less<>>;
  using Class = std::map<std::string, Attributes, std::less<>>;  ///< element -> attributes

  Documents& documents_;
  std::filesystem::path folder_;
  bool degrees_ = true, autolimits_ = true;
  std::string sequence_ = "xyz";
  std::map<std::string, Class, std::less<>> classes_{{"main", {}}};
  std::set<std::string> main_names_{"main"};  ///< of the top class, which may have a name
  mutable std::optional<Error> unknown_class_;
};

}  // namespace robomosp::robot_files
