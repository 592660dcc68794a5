// SPDX-License-Identifier: GPL-3.0-or-later
// FormRowWidget: one field of a form with its label, mark and faults (layer: GUI).
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <QWidget>

#include "kernel/fault.h"
#include "kernel/schema.h"
#include "viewer/forms/form_context.h"
#include "viewer/widgets/field.h"

class QGridLayout;
class QLabel;
class QVBoxLayout;

namespace robomosp::viewer {

/// A fault with what a form shows of it.
struct ShownFault {
  std::string path;  ///< of the value: "links[2].alpha"; empty = of the whole form
  QString sentence;
  std::vector<FaultRemedy> remedies;
  Severity severity = Severity::error;  ///< advice is shown in another colour
};
[[nodiscard]] ShownFault shown_fault(const Fault& fault);

/// One field with its label, mark, and the sentences of its faults below.
class FormRowWidget : public QWidget {
 public:
  FormRowWidget(const FormContextPtr& context, const ParamSpec& param, const std::string& path,
                QWidget* parent);
  [[nodiscard]] Field* field() const { return field_; }
  [[nodiscard]] const ParamSpec& param() const { return param_; }
  void set_changed(bool on);
  [[nodiscard]] bool is_changed() const { return is_changed_; }
  void show_fault(const ShownFault& fault,
                  const std::function<void(const FaultRemedy&)>& on_remedy);
  void clear_faults();
  [[nodiscard]] QString fault_text() const;
  /// A row of a form within a form has a narrower label.
  void set_is_inner(bool on);
  /// Whether the label is above the field, since there is no space beside it.
  [[nodiscard]] bool is_stacked() const { return is_stacked_; }
  QSize minimumSizeHint() const override;

  /// Called when the user gives up a value: "default" or "saved".
  std::function<void()> on_default, on_saved;

 protected:
  void paintEvent(QPaintEvent* event) override;
  void changeEvent(QEvent* event) override;
  void resizeEvent(QResizeEvent* event) override;
  void contextMenuEvent(QContextMenuEvent* event) override;

 private:
  void arrange();
  void take_lengths();
  [[nodiscard]] int label_width() const;
  ParamSpec param_;
  QLabel* label_;
  Field* field_;
  QGridLayout* grid_;
  QWidget* faults_ = nullptr;
  QVBoxLayout* fault_column_ = nullptr;
  bool is_changed_ = false, is_inner_ = false, is_stacked_ = false;
};

/// A sentence in the colour of faults with the remedies as links below.
[[nodiscard]] QWidget* fault_box(const ShownFault& fault,
                                 const std::function<void(const FaultRemedy&)>& on_remedy,
                                 const QString& name, QWidget* parent);
/// A label from a name: "sample_time" as "Sample time".
[[nodiscard]] QString readable(const std::string& label);

}  // namespace robomosp::viewer
