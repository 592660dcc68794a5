// SPDX-License-Identifier: GPL-3.0-or-later
// Fields made of several numbers: vectors, lists of numbers, matrices, poses, bands (layer: GUI).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <robomosp/sdk/types.h>

#include "viewer/widgets/field.h"
#include "viewer/widgets/number_field.h"

class QGridLayout;
class QPushButton;
class QToolButton;

namespace robomosp::viewer {

/// The index from 0 of a path that begins with "[3]"; nothing if it does not.
[[nodiscard]] std::optional<std::size_t> index_in_path(std::string_view path);
/// The elements of a list or array; empty for other values.
[[nodiscard]] std::vector<Value> elements_of(const Value& value);

/// Numbers side by side, three in a row. Components of x, y, z carry the colours of the axes. A
/// component is a number or a text, such as an expression.
class VectorField : public Field {
 public:
  struct Component {
    std::string name;  ///< may be empty
    NumberFormat format;
    int axis = -1;  ///< 0 to 2: colour of the mark
  };
  /// A fixed count of numbers.
  explicit VectorField(std::vector<Component> components, QWidget* parent = nullptr);
  /// Any count of numbers of one format, with buttons to add and remove the last.
  explicit VectorField(NumberFormat each, QWidget* parent = nullptr);

  [[nodiscard]] std::optional<Value> value() const override;
  void set_value(const std::optional<Value>& value) override;
  void set_default(const std::optional<Value>& value) override;
  void set_mixed(bool on) override;
  bool place_fault(std::string_view path, const QString& sentence) override;
  void clear_faults() override;
  [[nodiscard]] std::vector<PartFault> shown_faults() const override;
  [[nodiscard]] QString unit_beside() const override { return unit_beside_; }
  [[nodiscard]] bool is_tall() const override;
  /// Names and formats for a list of numbers, such as the joints of a robot; the count becomes
  /// fixed.
  void set_components(std::vector<Component> components);
  [[nodiscard]] const std::vector<NumberField*>& fields() const { return fields_; }
  /// Index of the component that changed last.
  [[nodiscard]] std::size_t changed_component() const { return changed_; }
  /// Numbers that expressions give now.
  void set_computed(std::size_t component, std::optional<double> si);
  void set_per_row(int count);

 protected:
  void resizeEvent(QResizeEvent* event) override;
  void take_theme() override;

 private:
  NumberField* add_field();
  void place_unit();
  void build(std::size_t count);
  void take(std::size_t index, Stage stage);
  void name_fields();
  std::vector<Component> components_;  ///< empty = any count
  NumberFormat each_;
  std::vector<NumberField*> fields_;
  std::optional<Value> value_;  ///< as it was set, until it is edited
  QGridLayout* grid_;
  QToolButton *more_ = nullptr, *fewer_ = nullptr;
  int per_row_ = 3;
  bool was_array_ = false;  ///< an array stays one as long as all are numbers
  std::size_t changed_ = 0;
  bool is_edited_ = false;  ///< by the user, at changed_, since it was set
  QString unit_beside_;
};

/// Rows of numbers; rows can be added and removed where their count is not fixed.
class MatrixField : public Field {
 public:
  MatrixField(std::size_t rows, std::size_t cols, NumberFormat each, QWidget* parent = nullptr);
  [[nodiscard]] std::optional<Value> value() const override;
  void set_value(const std::optional<Value>& value) override;
  bool place_fault(std::string_view path, const QString& sentence) override;
  void clear_faults() override;
  [[nodiscard]] std::vector<PartFault> shown_faults() const override;
  [[nodiscard]] bool is_tall() const override { return true; }

 private:
  void build(std::size_t rows, std::size_t cols);
  void resize_to(std::size_t rows, std::size_t cols);
  std::size_t fixed_rows_, fixed_cols_, rows_ = 0, cols_ = 0;
  NumberFormat each_;
  std::vector<NumberField*> fields_;  ///< row by row
  bool was_array_ = false;
  std::optional<std::size_t> changed_;  ///< the number that was edited last, since it was set
  std::optional<Value> value_;
  QGridLayout* grid_;
  QWidget* tools_;
};

/// Angles A, B, C about z, y, x of R = Rz(A) Ry(B) Rx(C) [rad]; A is 0 where only the sum of A and
/// C counts.
[[nodiscard]] Vec3 angles_about_zyx(const Pose& pose);

/// Position and orientation: as angles A, B, C about z, y, x, as a quaternion, as an axis with an
/// angle, or as a matrix. Other representations that commands take (cylindrical, Euler angles ...)
/// are kept until an edit.
class PoseField : public Field {
 public:
  enum class Shown { angles, quaternion, axis, matrix };
  explicit PoseField(QWidget* parent = nullptr);
  [[nodiscard]] std::optional<Value> value() const override { return value_; }
  void set_value(const std::optional<Value>& value) override;
  void set_mixed(bool on) override;
  bool place_fault(std::string_view path, const QString& sentence) override;
  void clear_faults() override;
  [[nodiscard]] std::vector<PartFault> shown_faults() const override;
  [[nodiscard]] bool is_tall() const override { return true; }
  void show_as(Shown shown);
  [[nodiscard]] Shown shown_as() const { return shown_; }
  [[nodiscard]] Pose pose() const { return pose_; }
  /// Sources of a pose, as buttons; an empty function hides its button. They call set_pose() when
  /// they have one.
  void set_sources(std::function<void()> from_selection, std::function<void()> from_view);
  /// As an edit by the user.
  void set_pose(const Pose& pose);
  /// Copies the pose as Lua, and takes one from the clipboard: Lua, or 3, 6, 7, 12 or 16 numbers.
  void copy() const;
  void paste();
  QSize minimumSizeHint() const override;

 protected:
  void take_theme() override;
  void resizeEvent(QResizeEvent* event) override;

 private:
  void make_buttons();
  void show_pose();
  void show_button_texts();
  void take(Field* changed, Stage stage);
  [[nodiscard]] std::vector<Field*> parts() const;
  std::optional<Value> value_;
  bool was_matrix_ = false;  ///< a matrix stays one
  Pose pose_{};
  Shown shown_ = Shown::angles;
  VectorField *position_, *angles_, *quaternion_, *axis_;
  MatrixField* matrix_;
  Field* changed_ = nullptr;  ///< the part that was edited since the value was set
  std::vector<QPushButton*> segments_;
  QPushButton *from_selection_ = nullptr, *from_view_ = nullptr, *copy_ = nullptr,
              *paste_ = nullptr;
  bool is_setting_ = false;
};

/// A lower and an upper bound with the range between them; either may be missing. The value is a
/// list of two numbers.
class BandField : public Field {
 public:
  explicit BandField(NumberFormat format, QWidget* parent = nullptr);
  [[nodiscard]] std::optional<Value> value() const override;
  void set_value(const std::optional<Value>& value) override;
  bool place_fault(std::string_view path, const QString& sentence) override;
  void clear_faults() override;
  /// The range of the bar [SI], and the value marked in it.
  void set_range(double from, double to);
  void set_marked(std::optional<double> si);
  [[nodiscard]] NumberField* lower() const { return lower_; }
  [[nodiscard]] NumberField* upper() const { return upper_; }
  QSize sizeHint() const override;

 protected:
  void paintEvent(QPaintEvent* event) override;
  void resizeEvent(QResizeEvent* event) override;

 private:
  NumberField *lower_, *upper_;
  double from_ = -1, to_ = 1;
  std::optional<double> marked_;
};

}  // namespace robomosp::viewer
