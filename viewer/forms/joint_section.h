// SPDX-License-Identifier: GPL-3.0-or-later
// JointSection: the joints of a robot in a world as bars with limits, and the pose of its tool
// (layer: GUI).
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <QWidget>

#include "ioci/client/client.h"
#include "kernel/value.h"
#include "viewer/widgets/field.h"

class QLabel;
class QVBoxLayout;

namespace robomosp::viewer {

class JointRow;
class PoseField;

/// Joints are dragged, stepped or typed: world.set_robot_q, a drag being one gesture. The pose of
/// the tool in the robot's base is typed or dragged: robot.solve_ik finds the joints near the
/// present ones; a pose out of reach keeps its sentence. [GUI thread]
class JointSection : public QWidget {
 public:
  /// The client outlives the section.
  JointSection(ioci::Client& client, Handle world, std::string member, QWidget* parent);
  ~JointSection() override;
  /// Asks for the joint values again; ignored during a drag.
  void refresh();
  [[nodiscard]] const std::vector<JointRow*>& joints() const { return rows_; }
  [[nodiscard]] PoseField* tool() const { return tool_; }
  [[nodiscard]] const Handle& world() const { return world_; }
  [[nodiscard]] const std::string& member() const { return member_; }

  std::function<void()> on_shown;  ///< after new values were shown

 private:
  void ask_links();
  void make_rows(const List& links, const Value* poses);
  void show_q(const std::vector<double>& q);
  void ask_pose();
  /// Begins or ends the gesture of a drag; true if values are to be sent.
  bool is_edit(Field::Stage stage);
  [[nodiscard]] List shown_joints() const;
  void edit_joints(Field::Stage stage);
  void edit_pose(Field::Stage stage);
  void send(const List& q);
  void begin();
  void end(bool keep);
  ioci::Client& client_;
  Handle world_, robot_;
  std::string member_;
  std::vector<JointRow*> rows_;
  std::vector<double> home_;
  PoseField* tool_;
  QLabel* note_;
  QVBoxLayout* column_;
  std::optional<Value> q_;  ///< as world.robots gave it
  ioci::Client::Edits gesture_;
  bool is_dragged_ = false;
  int poses_asked_ = 0;
};

}  // namespace robomosp::viewer
