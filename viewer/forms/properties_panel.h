// SPDX-License-Identifier: GPL-3.0-or-later
// PropertiesPanel: the fields of what is selected (layer: GUI).
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <QTimer>
#include <QWidget>

#include "ioci/client/client.h"
#include "kernel/schema.h"
#include "viewer/forms/form_context.h"
#include "viewer/forms/selected_paths.h"
#include "viewer/theme/theme.h"

class QLabel;
class QScrollArea;
class QHBoxLayout;
class QVBoxLayout;

namespace robomosp::viewer {

class JointSection;
class MassSection;
class SegmentSection;
class UsersSection;
class SchemaForm;

/// The fields of a table of fields at a path of a record: of the record itself, of an element of a
/// list ("links[2]", "links.elbow"), or of a named node anywhere below ("hub_bore").
struct FieldsAt {
  Schema schema;
  Map values;
  std::string path;   ///< as record.set takes it; may differ from what was asked for
  std::string title;  ///< "cylinder", "link"
};
[[nodiscard]] std::optional<FieldsAt> fields_at(const Schema& schema, const Map& values,
                                                std::string_view path);

/// Fields of the selected records from record.schema and record.describe, changed by record.set:
/// a drag is one gesture, a typed value one step. Of several selected, the fields they have in
/// common; an edit sets all of them in one step. Faults of the record and of edits are shown at
/// their fields, with remedies. It follows changes by others. [GUI thread]
class PropertiesPanel : public QWidget {
 public:
  /// The client outlives the panel. Its host passes events on by take().
  explicit PropertiesPanel(ioci::Client& client, QWidget* parent = nullptr);
  ~PropertiesPanel() override;

  void set_selection(const SelectedPaths& selection);
  [[nodiscard]] const SelectedPaths& selection() const { return selection_; }
  /// Events of the topic `change`; others are ignored.
  void take(const ioci::Event& event);
  /// Asks for all values again.
  void refresh();
  [[nodiscard]] SchemaForm* form() const { return form_; }
  /// The joints of the selected robot of a world; null = none is selected.
  [[nodiscard]] JointSection* joints() const { return joints_; }
  /// Sections below the fields; null = the selection has none.
  [[nodiscard]] MassSection* mass() const { return mass_; }
  [[nodiscard]] UsersSection* users() const { return users_; }
  [[nodiscard]] SegmentSection* segment() const { return segment_; }
  [[nodiscard]] QString title() const;
  /// False while values that changed are still to be asked for.
  [[nodiscard]] bool is_settled() const { return !refresh_timer_.isActive(); }
  /// The sentence of an edit that was refused and has no field.
  [[nodiscard]] QString outcome() const;

  std::function<void()> on_shown;  ///< after fields or values changed
  std::function<void(const std::string& page)> on_help;
  std::function<void(const Handle&)> on_go;  ///< a link to another record
  /// Gives the pose of the camera of the current view; empty = poses offer none. Counts for forms
  /// drawn afterwards.
  std::function<void(std::function<void(const Value&)>)> pose_of_view;

 protected:
  void changeEvent(QEvent* event) override;

 private:
  void apply_theme();
  struct Shown;
  void ask_values();
  void take_values();
  void draw();
  void draw_joints();
  void draw_sections();
  void drop_sections();
  /// Ends the gesture of a drag, if there is one, as one step or without a trace.
  void end_drag(bool keeps);
  void edit(const std::string& path, const std::optional<Value>& value, int stage);
  void set_one(const Shown& shown, const std::string& path, const std::optional<Value>& value,
               const ioci::Client::Edits& in);
  void set_parameters(const Shown& shown, const std::optional<Value>& value);
  void show_refusal(const std::string& path, const Error& error);
  void ask_faults();
  void ask_picture();
  ioci::Client& client_;
  SelectedPaths selection_;
  std::vector<Shown> shown_;
  std::map<std::string, Schema> schemas_;  ///< by kind
  SchemaForm* form_ = nullptr;
  JointSection* joints_ = nullptr;
  MassSection* mass_ = nullptr;
  UsersSection* users_ = nullptr;
  SegmentSection* segment_ = nullptr;
  std::string form_of_;  ///< kind and path that the form was drawn for
  std::shared_ptr<FormContext> context_;
  QLabel *title_, *subtitle_, *outcome_, *picture_;
  QScrollArea* scroll_;
  QWidget* page_;
  int themed_ = theme_revision();
  QHBoxLayout* head_;
  QVBoxLayout* column_;
  ioci::Client::Edits gesture_;
  int asked_ = 0, pictures_ = 0;
  std::size_t missing_ = 0;
  bool is_dragged_ = false;
  bool is_drawing_ = false, is_picture_wanted_ = false;  ///< the picture of a material
  QTimer refresh_timer_, fault_timer_;
};

}  // namespace robomosp::viewer
