// SPDX-License-Identifier: Apache-2.0
// The models of an SDF file: nested and included ones, their names by scope ("arm::hand"), and the
// poses of all frames in the outermost model (layer: plugin).
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "documents.h"

namespace robomosp::robot_files {

[[nodiscard]] std::string_view text_of(const Element& e, const char* child);
[[nodiscard]] Result<double> real_of(const Element& e, const char* child, double otherwise);
[[nodiscard]] Result<Vec3> triple_of(const Element& e, const char* child, Vec3 otherwise);

/// A link, joint or frame with the scope for resolving its names.
struct Scoped {
  const Element* e = nullptr;
  std::string scope;  ///< "" or "arm::"
  std::string model;  ///< name of the frame of the model around it
  std::string name;   ///< with the scope
};

class SdfModels {
 public:
  SdfModels(Documents& documents, std::filesystem::path folder)
      : documents_(documents), folder_(std::move(folder)) {}

  /// Reads the model that moves, else the first one, of the file or of its world.
  Result<void> read(const Element& root);

  [[nodiscard]] const Element& model() const { return *model_; }
  /// All <model> elements that were read, the outermost first.
  [[nodiscard]] const std::vector<const Element*>& models() const { return models_; }
  [[nodiscard]] const std::vector<Scoped>& links() const { return links_; }
  [[nodiscard]] const std::vector<Scoped>& joints() const { return joints_; }
  [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }
  /// Included models that were not found, or "".
  [[nodiscard]] const std::string& missing() const { return missing_; }

  /// Resolves a name used by an element in the scope.
  static std::string full_name(const Scoped& in, std::string_view name);
  /// model_T_frame of the outermost model; a cycle is an error.
  Result<Pose> pose_of(const Element& asked, const std::string& name);
  /// The pose of `e` in a frame: its own, or relative to the frame named by relative_to.
  Result<Pose> pose_in(const Scoped& around, const Element& e, const std::string& frame);
  /// The link to which a link, frame, joint or model is attached; "world" for the world, "" for
  /// none.
  [[nodiscard]] std::string link_of(std::string name) const;
  /// Folder of the element's file.
  [[nodiscard]] std::filesystem::path folder_of(const Element& e) const;

 private:
  struct Frame {
    const Element* e = nullptr;  ///< element with the <pose>; none = at its base
    std::string base;            ///< reference frame of its pose; "" = the outermost model
    std::string placed;          ///< the frame of this model to which the pose applies; "" = itself
    std::string stands_on;       ///< the frame it is attached to; "" = it is a link
    bool is_done = false;
    Pose pose;  ///< model_T_frame
  };
  struct Open {
    const Element* e;          ///< <model>
    const Element* include;    ///< overrides the model's pose and name, or nullptr
    std::string scope, model;  ///< of the model around it
  };

  Result<const Element*> included(const Element& include);
  Result<void> open(const Open& o, std::vector<Open>& inside);
  Result<Pose> local_pose(const Element& asked, const std::string& name, const std::string& stop,
                          int depth);
  static std::string relative_to(const Element& e);

  Documents& documents_;
  std::filesystem::path folder_;
  const Element* model_ = nullptr;
  std::vector<const Element*> models_;
  std::vector<Scoped> links_, joints_;
  std::map<std::string, Frame> frames_;
  std::vector<std::string> notes_;
  std::string missing_;
};

}  // namespace robomosp::robot_files
