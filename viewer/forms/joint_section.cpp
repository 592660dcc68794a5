// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/forms/joint_section.h"

#include <cmath>

#include <QLabel>
#include <QPointer>
#include <QVBoxLayout>

#include "kernel/type.h"
#include "viewer/forms/form_context.h"
#include "viewer/theme/theme.h"
#include "viewer/widgets/gauge.h"
#include "viewer/widgets/number_fields.h"

namespace robomosp::viewer {
namespace {

QLabel* section_title(QWidget* parent, const QString& text, const QString& name) {
  auto* l = new QLabel(text, parent);
  l->setObjectName(name);
  l->setAccessibleName(text);
  l->setToolTip(text);
  use_font(*l, &Theme::ui, true);
  return l;
}

}  // namespace

JointSection::JointSection(ioci::Client& client, Handle world, std::string member, QWidget* parent)
    : QWidget(parent),
      client_(client),
      world_(std::move(world)),
      member_(std::move(member)),
      tool_(new PoseField(this)),
      note_(new QLabel(this)),
      column_(new QVBoxLayout(this)) {
  setObjectName("joints");
  setAccessibleName("Joints and tool");
  column_->setContentsMargins(0, 0, 0, theme().px(8));
  column_->setSpacing(0);
  column_->addWidget(section_title(this, "Joints", "joints.title"));
  column_->addWidget(section_title(this, "Tool in base", "joints.tool_title"));
  tool_->describe("Tool in base", "Pose of the tool; the joints follow.",
                  "robot.solve_ik{target = }", "joints.tool");
  tool_->on_change = [this](Field::Stage stage) { edit_pose(stage); };
  column_->addWidget(tool_);
  note_->setObjectName("joints.note");
  note_->setAccessibleName("Why the tool cannot be there");
  note_->setToolTip(note_->accessibleName());
  note_->setProperty("fault", true);
  note_->setWordWrap(true);
  note_->hide();
  column_->addWidget(note_);
  refresh();
}

JointSection::~JointSection() {
  if (is_dragged_) client_.commit(gesture_);
}

void JointSection::refresh() {
  if (is_dragged_) return;
  ask(client_, "world.robots", Map{{"id", world_}}, this, [this](const Result<Value>& r) {
    if (is_dragged_ || !r.ok() || !r->as_list()) return;
    for (const Value& each : *r->as_list()) {
      const Map* m = each.as_map();
      const Value* name = m ? m->find("name") : nullptr;
      if (!name || name->text() != member_) continue;
      const Value* q = m->find("q");
      q_ = q && !q->is_nil() ? std::optional(*q) : std::nullopt;
      const Value* robot = m->find("robot");
      if (robot && robot->as_handle()) robot_ = *robot->as_handle();
      ask_links();
    }
  });
}

void JointSection::ask_links() {
  ask(client_, "robot.describe", Map{{"id", robot_}}, this, [this](const Result<Value>& r) {
    if (is_dragged_ || !r.ok() || !r->as_map()) return;
    const Value* links = r->as_map()->find("links");
    if (links && links->as_list()) make_rows(*links->as_list(), r->as_map()->find("poses"));
  });
}

void JointSection::make_rows(const List& links, const Value* poses) {
  struct Joint {
    QString name;
    NumberFormat format;
  };
  std::vector<Joint> joints;
  for (const Value& link : links) {
    const Map* m = link.as_map();
    if (!m) return;
    const auto word = [m](const char* name) {
      const Value* v = m->find(name);
      return v && v->as_string() ? *v->as_string() : std::string();
    };
    const Value* mimic = m->find("mimic");
    if (word("joint") == "fixed" || (mimic && !mimic->is_nil())) continue;
    NumberFormat f;
    f.unit = word("joint") == "prismatic" ? "m" : "rad";
    f.shown = std::string(shown_unit_of(f.unit));
    const Value *lower = m->find("lower"), *upper = m->find("upper");
    if (lower && lower->is_number()) f.min = lower->number();
    if (upper && upper->is_number()) f.max = upper->number();
    joints.push_back({qt(word("name")), f});
  }
  home_.assign(joints.size(), 0);
  const Value* home = poses && poses->as_map() ? poses->as_map()->find("home") : nullptr;
  if (home) {
    const auto values = elements_of(*home);
    for (std::size_t i = 0; i < std::min(values.size(), home_.size()); ++i)
      home_[i] = values[i].number();
  }
  bool is_same = rows_.size() == joints.size();
  for (std::size_t i = 0; is_same && i < rows_.size(); ++i)
    is_same = rows_[i]->accessibleName() == joints[i].name &&
              rows_[i]->field()->format().min == joints[i].format.min &&
              rows_[i]->field()->format().max == joints[i].format.max;
  if (!is_same) {
    for (JointRow* row : rows_) {
      row->hide();
      row->deleteLater();
    }
    rows_.clear();
    int number = 0;
    for (const Joint& j : joints) {
      auto* row = new JointRow(++number, j.name, j.format, this);
      row->describe(j.name, "Drag the bar, step by - and +, or type.", "world.set_robot_q{q = }",
                    QString("joints.%1").arg(number));
      row->on_change = [this](Field::Stage stage) { edit_joints(stage); };
      column_->insertWidget(number, row);
      row->show();
      rows_.push_back(row);
    }
  }
  std::vector<double> q = home_;
  if (q_) {
    const auto values = elements_of(*q_);
    for (std::size_t i = 0; i < std::min(values.size(), q.size()); ++i) q[i] = values[i].number();
  }
  show_q(q);
}

void JointSection::show_q(const std::vector<double>& q) {
  for (std::size_t i = 0; i < std::min(q.size(), rows_.size()); ++i)
    if (!rows_[i]->field()->is_editing()) rows_[i]->set_value(Value(q[i]));
  ask_pose();
  if (on_shown) on_shown();
}

void JointSection::ask_pose() {
  const int number = ++poses_asked_;
  List q;
  for (const JointRow* row : rows_) q.push_back(row->value().value_or(Value(0.0)));
  ask(client_, "robot.fk", Map{{"id", robot_}, {"q", q}}, this,
      [this, number](const Result<Value>& r) {
        if (number != poses_asked_ || is_dragged_ || !r.ok() || !r->as_map()) return;
        const Value* pose = r->as_map()->find("pose");
        if (pose) tool_->set_value(*pose);
        if (on_shown) on_shown();
      });
}

void JointSection::begin() {
  if (is_dragged_) return;
  gesture_ = client_.begin_gesture("move " + member_);
  is_dragged_ = true;
}

void JointSection::end(bool keep) {
  if (!is_dragged_) return;
  is_dragged_ = false;
  if (keep) client_.commit(gesture_);
  else client_.cancel(gesture_);
  gesture_ = {};
  refresh();
}

void JointSection::send(const List& q) {
  Map args{{"id", world_}, {"robot", member_}, {"q", q}};
  const QPointer<JointSection> self = this;
  const auto done = [self](const Result<Value>& r) {
    if (!self) return;
    const bool is_refused = !r.ok() && r.error().code != ErrorCode::cancelled;
    self->note_->setVisible(is_refused);
    if (is_refused) self->note_->setText(qt(r.error().sentence()));
  };
  if (is_dragged_) client_.update(gesture_, "world.set_robot_q", std::move(args), done);
  else client_.call("world.set_robot_q", std::move(args), done);
}

bool JointSection::is_edit(Field::Stage stage) {
  switch (stage) {
    case Field::Stage::drag_begun: begin(); return false;
    case Field::Stage::drag_ended: end(true); return false;
    case Field::Stage::drag_cancelled: end(false); return false;
    case Field::Stage::dragged:
    case Field::Stage::changed: break;
  }
  return true;
}

List JointSection::shown_joints() const {
  List q;
  for (const JointRow* row : rows_) q.push_back(row->value().value_or(Value(0.0)));
  return q;
}

void JointSection::edit_joints(Field::Stage stage) {
  if (is_edit(stage)) send(shown_joints());
}

void JointSection::edit_pose(Field::Stage stage) {
  if (!is_edit(stage)) return;
  const int number = ++poses_asked_;
  ask(client_, "robot.solve_ik",
      Map{{"id", robot_}, {"target", tool_->value().value_or(Value())}, {"seed", shown_joints()}},
      this, [this, number](const Result<Value>& r) {
        if (number != poses_asked_) return;
        const Map* m = r.ok() ? r->as_map() : nullptr;
        const Value* q = m ? m->find("q") : nullptr;
        const Value* status = m ? m->find("status") : nullptr;
        const bool is_solved = q && (!status || status->text() == "solved");
        if (!is_solved) {
          const Value* detail = m ? m->find("detail") : nullptr;
          note_->setText(!r.ok()  ? qt(r.error().sentence())
                         : detail ? qt(detail->text())
                                  : QString("The tool cannot reach this pose."));
          note_->show();
          if (on_shown) on_shown();
          return;
        }
        note_->hide();
        const auto values = elements_of(*q);
        for (std::size_t i = 0; i < std::min(values.size(), rows_.size()); ++i)
          rows_[i]->set_value(values[i]);
        send(List(values.begin(), values.end()));
        if (on_shown) on_shown();
      });
}

}  // namespace robomosp::viewer
