// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/forms/properties_panel.h"

#include <algorithm>
#include <utility>

#include <QDir>
#include <QFile>
#include <QHBoxLayout>
#include <QLabel>
#include <QScrollArea>
#include <QVBoxLayout>

#include "kernel/argument_faults.h"
#include "kernel/text.h"
#include "kernel/type.h"
#include "kernel/type_forms.h"
#include "viewer/forms/joint_section.h"
#include "viewer/forms/record_sections.h"
#include "viewer/forms/schema_form.h"
#include "viewer/theme/theme.h"
#include "viewer/widgets/number_fields.h"

namespace robomosp::viewer {
namespace {

constexpr int kDeepestSearch = 64;
constexpr int kRefreshDelay = 30, kFaultDelay = 250;  // [ms]

/// The fields that a value of a type has, and what it is called.
struct Fields {
  Schema schema;
  std::string title;
};
std::optional<Fields> fields_of(const TypeTree* t, const Value& v) {
  if (t->kind == TypeKind::named) {
    t = named_type(t->word);
    if (!t) return std::nullopt;
  }
  if (t->kind == TypeKind::one_of) {
    for (const auto& option : t->options)
      if (auto found = fields_of(option.get(), v)) return found;
    return std::nullopt;
  }
  if ((t->kind == TypeKind::map || t->kind == TypeKind::table) && !t->fields.empty())
    return Fields{t->fields, {}};
  if (t->kind != TypeKind::variant || !v.as_map()) return std::nullopt;
  const Value* word = v.as_map()->find(t->decided_by);
  for (const auto& [name, fields] : t->cases) {
    if (!word || word->text() != name) continue;
    ParamSpec decides;
    decides.name = t->decided_by;
    decides.type = "enum";
    decides.required = true;
    for (const auto& [each, unused] : t->cases) decides.choices.push_back(each);
    Fields out{fields, name};
    if (!find_param(out.schema, t->decided_by))
      out.schema.insert(out.schema.begin(), std::move(decides));
    return out;
  }
  return std::nullopt;
}

/// A node of a solid as type:node describes it: record.describe gives its sizes as fields, and its
/// placement as one.
std::optional<FieldsAt> node_fields(const Value& node) {
  const Map* m = node.as_map();
  const Value* kind = m ? m->find("kind") : nullptr;
  const TypeTree* t = named_type("node");
  if (!kind || !t || t->kind != TypeKind::variant) return std::nullopt;
  for (const auto& [word, fields] : t->cases) {
    if (word != kind->text()) continue;
    FieldsAt out;
    out.title = word;
    for (const ParamSpec& p : fields) {
      const TypeKind held = type_tree(p.type).kind;
      // Other nodes have rows of their own in the tree; the placement is shown in one form.
      constexpr std::string_view kOtherForms[] = {"placement",  "cylindrical", "spherical",
                                                  "xyz",        "zyz",         "quaternion",
                                                  "axis_angle", "frame",       "children"};
      const bool is_other = std::find(std::begin(kOtherForms), std::end(kOtherForms), p.name) !=
                            std::end(kOtherForms);
      if (held == TypeKind::list || held == TypeKind::named || is_other) continue;
      out.schema.push_back(p);
      if (p.name == "rpy") out.schema.back().label = "Turned by";
    }
    out.values = *m;
    if (const Value* placement = m->find("placement"); placement && placement->as_map())
      for (const auto& [name, v] : *placement->as_map())
        if (find_param(fields, name)) out.values.set(name, v);
    return out;
  }
  return std::nullopt;
}

const TypeTree* element_type(const TypeTree* t) {
  if (t->kind == TypeKind::named) t = named_type(t->word);
  if (!t) return nullptr;
  if (t->kind == TypeKind::list && t->element) return t->element.get();
  if (t->kind == TypeKind::table) return t;  // its fields are those of a row
  if (t->kind == TypeKind::map && t->fields.empty() && t->element) return t->element.get();
  return nullptr;
}

bool is_named(const Value& v, std::string_view name) {
  const Map* m = v.as_map();
  const Value* own = m ? m->find("name") : nullptr;
  return own && own->as_string() && *own->as_string() == name;
}

/// The index of an element of a list by a step of a path: its name, or else its number from 1.
std::optional<std::size_t> element_at(const List& list, std::string_view step) {
  for (std::size_t i = 0; i < list.size(); ++i)
    if (is_named(list[i], step)) return i;
  const auto number = text::read_int(step);
  if (!number || *number < 1 || static_cast<std::size_t>(*number) > list.size())
    return std::nullopt;
  return static_cast<std::size_t>(*number) - 1;
}

struct Found {
  const TypeTree* type = nullptr;
  const Value* value = nullptr;
};
/// An element with that name, anywhere below fields.
std::optional<Found> named_below(const Schema& schema, const Map& values, std::string_view name,
                                 int depth) {
  if (depth > kDeepestSearch) return std::nullopt;
  for (const ParamSpec& p : schema) {
    const Value* v = values.find(p.name);
    if (!v) continue;
    const TypeTree* t = &type_tree(p.type);
    const auto look = [&](const TypeTree* type, const Value& each) -> std::optional<Found> {
      if (is_named(each, name)) return Found{type, &each};
      const auto inner = each.as_map() ? fields_of(type, each) : std::nullopt;
      return inner ? named_below(inner->schema, *each.as_map(), name, depth + 1) : std::nullopt;
    };
    if (v->as_map())
      if (const auto found = look(t, *v)) return found;
    if (const TypeTree* element = element_type(t); element && v->as_list())
      for (const Value& each : *v->as_list())
        if (const auto found = look(element, each)) return found;
  }
  return std::nullopt;
}

/// A path of a record, "points.2.position", as fields of a form have it: "points[2].position".
std::string with_brackets(std::string_view path) {
  std::string out;
  for (const std::string_view step : text::split(path, '.')) {
    if (text::read_int(step)) out += "[" + std::string(step) + "]";
    else out += (out.empty() ? "" : ".") + std::string(step);
  }
  return out;
}

/// Puts an expression into values at a path: "radius", "position.x", "links[2].a".
void put_expression(Map& values, std::string_view path, const std::string& text) {
  const auto end = std::min(path.find('.'), path.find('['));
  const std::string name(path.substr(0, end));
  Value* v = values.find(name);
  if (!v && end != std::string_view::npos && path[end] == '.') {
    // The name of an element of one of the lists.
    for (const auto& [field, list] : Map(values)) {
      if (!list.as_list()) continue;
      List all = *list.as_list();
      for (Value& each : all)
        if (is_named(each, name)) {
          put_expression(*each.as_map(), path.substr(end + 1), text);
          values.set(field, Value(std::move(all)));
          return;
        }
    }
  }
  if (!v) return;
  if (end == std::string_view::npos) {
    *v = Value(text);
    return;
  }
  const std::string_view rest = path.substr(end);
  if (rest.front() == '.' && v->as_map()) {
    put_expression(*v->as_map(), rest.substr(1), text);
    return;
  }
  List parts = elements_of(*v);
  std::optional<std::size_t> index = index_in_path(rest);
  if (rest.front() == '.' && rest.size() == 2 && rest[1] >= 'x' && rest[1] <= 'z')
    index = static_cast<std::size_t>(rest[1] - 'x');
  std::string_view below;
  if (index) {
    if (rest.front() == '[') below = rest.substr(rest.find(']') + 1);
  } else if (rest.front() == '.') {  // an element by its name or number
    const std::string_view tail = rest.substr(1);
    const std::string_view key = tail.substr(0, std::min(tail.find('.'), tail.find('[')));
    index = element_at(parts, key);
    below = tail.substr(key.size());
  }
  if (!index || *index >= parts.size()) return;
  if (below.empty()) parts[*index] = Value(text);
  else if (Map* m = parts[*index].as_map(); m && below.front() == '.')
    put_expression(*m, below.substr(1), text);
  *v = Value(std::move(parts));
}

/// The parameters of a record as a map of expressions, in place of its field `parametric`.
void add_parameters(FieldsAt& fields) {
  const auto it = std::find_if(fields.schema.begin(), fields.schema.end(),
                               [](const ParamSpec& p) { return p.name == "parametric"; });
  if (it == fields.schema.end()) return;
  fields.schema.erase(it);
  ParamSpec p;
  p.name = "parameters";
  p.type = "map<expression>";
  p.doc = "Named quantities for the expressions of this record.";
  fields.schema.push_back(std::move(p));
  Map texts;
  if (const Value* all = fields.values.find("parameters"); all && all->as_map())
    for (const auto& [name, about] : *all->as_map()) {
      const Map* m = about.as_map();
      const Value* text = m ? m->find("expression") : nullptr;
      if (m && !text) text = m->find("text");
      texts.set(name, text ? *text : about);
    }
  if (texts.empty()) fields.values.erase("parameters");
  else fields.values.set("parameters", Value(std::move(texts)));
}

}  // namespace

std::optional<FieldsAt> fields_at(const Schema& schema, const Map& values, std::string_view path) {
  FieldsAt out{schema, values, std::string(path), {}};
  std::string_view rest = path;
  while (!rest.empty()) {
    if (rest.front() == '.') rest.remove_prefix(1);
    const auto end = std::min(rest.find('.'), rest.find('['));
    const std::string_view name = rest.substr(0, end);
    rest = end == std::string_view::npos ? std::string_view() : rest.substr(end);
    Found at;
    const ParamSpec* p = find_param(out.schema, name);
    const Value* v = p ? out.values.find(name) : nullptr;
    if (p && v) {
      at = {&type_tree(p->type), v};
      // Elements of lists, by place or by name.
      while (!rest.empty() && element_type(at.type)) {
        const TypeTree* element = element_type(at.type);
        const Value* found = nullptr;
        std::string_view after;
        if (const auto i = index_in_path(rest)) {
          const List* list = at.value->as_list();
          if (!list || *i >= list->size()) return std::nullopt;
          found = &(*list)[*i];
          after = rest.substr(rest.find(']') + 1);
        } else {
          const std::string_view tail = rest.substr(1);
          const std::string_view key = tail.substr(0, std::min(tail.find('.'), tail.find('[')));
          after = tail.substr(key.size());
          if (const List* list = at.value->as_list()) {
            if (const auto place = element_at(*list, key)) found = &(*list)[*place];
          } else if (const Map* m = at.value->as_map()) {
            found = m->find(key);
          }
        }
        if (!found) return std::nullopt;
        at = {element, found};
        rest = after;
      }
    } else {
      const auto found = named_below(out.schema, out.values, name, 0);
      if (!found) return std::nullopt;
      at = *found;
    }
    // The navigator names a node "nodes.bore", expressions name it "bore".
    if (out.values.find("nodes") && rest.empty())
      if (auto node = node_fields(*at.value)) {
        node->path = out.path;
        return node;
      }
    if (!at.value->as_map()) return std::nullopt;
    auto inner = fields_of(at.type, *at.value);
    if (!inner) return std::nullopt;
    out.title = inner->title;
    Map next = *at.value->as_map();
    out.schema = std::move(inner->schema);
    out.values = std::move(next);
  }
  return out;
}

struct PropertiesPanel::Shown {
  SelectedPath at;
  std::string kind, name;
  Map described;
  std::optional<FieldsAt> fields;
  Map computed;  ///< values before expressions were put in
};

PropertiesPanel::PropertiesPanel(ioci::Client& client, QWidget* parent)
    : QWidget(parent), client_(client) {
  setObjectName("properties");
  setAccessibleName("Properties");
  setProperty("ground", "panel");  // one with the fields, below the head of the dock
  setAttribute(Qt::WA_StyledBackground);
  auto* outer = new QVBoxLayout(this);
  outer->setContentsMargins(0, 0, 0, 0);
  outer->setSpacing(0);
  const auto label = [&](QWidget* owner, const QString& name, const QString& accessible,
                         const char* property) {
    auto* l = new QLabel(owner);
    l->setObjectName(name);
    l->setAccessibleName(accessible);
    l->setToolTip(accessible);
    if (property) l->setProperty(property, true);
    return l;
  };
  auto* head = new QHBoxLayout;
  head_ = head;
  title_ = label(this, "properties.title", "What is selected", nullptr);
  use_font(*title_, &Theme::ui, true);
  subtitle_ = label(this, "properties.subtitle", "Where it is", "quiet");
  subtitle_->setAlignment(Qt::AlignRight | Qt::AlignVCenter);
  head->addWidget(title_, 1);
  head->addWidget(subtitle_);
  outer->addLayout(head);
  scroll_ = new QScrollArea(this);
  scroll_->setObjectName("properties.area");
  scroll_->setAccessibleName("Fields");
  scroll_->setFocusPolicy(Qt::NoFocus);  // its fields take it, and scroll it
  scroll_->setToolTip("Fields of what is selected");
  scroll_->setFrameShape(QFrame::NoFrame);
  scroll_->setWidgetResizable(true);
  scroll_->setHorizontalScrollBarPolicy(Qt::ScrollBarAlwaysOff);
  page_ = new QWidget(scroll_);
  page_->setObjectName("properties.page");
  page_->setAccessibleName("Fields");
  column_ = new QVBoxLayout(page_);
  picture_ = label(page_, "properties.picture", "Picture of the material", nullptr);
  picture_->hide();
  column_->addWidget(picture_, 0, Qt::AlignLeft);
  outcome_ = label(page_, "properties.outcome", "Outcome of the last edit", "fault");
  outcome_->setWordWrap(true);
  outcome_->hide();
  column_->addWidget(outcome_);
  column_->addStretch(1);
  scroll_->setWidget(page_);
  outer->addWidget(scroll_, 1);
  refresh_timer_.setSingleShot(true);
  refresh_timer_.setInterval(kRefreshDelay);
  QObject::connect(&refresh_timer_, &QTimer::timeout, this, [this] { ask_values(); });
  fault_timer_.setSingleShot(true);
  fault_timer_.setInterval(kFaultDelay);
  QObject::connect(&fault_timer_, &QTimer::timeout, this, [this] {
    ask_faults();
    ask_picture();
  });
  apply_theme();
  set_selection({});
}

void PropertiesPanel::apply_theme() {
  const Theme& t = theme();
  head_->setContentsMargins(t.px(12), t.px(6), t.px(12), t.px(6));
  column_->setContentsMargins(t.px(12), t.px(4), t.px(12), t.px(12));
}

void PropertiesPanel::changeEvent(QEvent* event) {
  if (std::exchange(themed_, theme_revision()) != theme_revision()) apply_theme();
  QWidget::changeEvent(event);
}

PropertiesPanel::~PropertiesPanel() = default;

QString PropertiesPanel::title() const { return title_->text(); }
QString PropertiesPanel::outcome() const { return outcome_->text(); }

void PropertiesPanel::set_selection(const SelectedPaths& selection) {
  end_drag(true);
  selection_ = selection;
  shown_.clear();
  outcome_->hide();
  picture_->hide();
  drop_sections();
  if (selection_.empty()) {
    title_->setText("Nothing is selected");
    subtitle_->clear();
    if (form_) {
      form_->hide();
      form_->deleteLater();
      form_ = nullptr;
    }
    form_of_.clear();
    if (joints_) joints_->deleteLater();
    joints_ = nullptr;
    return;
  }
  ask_values();
}

void PropertiesPanel::refresh() {
  if (!selection_.empty()) ask_values();
}

void PropertiesPanel::take(const ioci::Event& event) {
  if (!event.change) return;
  for (const auto& record : event.change->records)
    for (const SelectedPath& s : selection_)
      if (record.id.number == s.record.number) {
        // The mass is asked for at once, so that it follows a drag.
        if (mass_) mass_->refresh();
        if (users_) users_->refresh();
        if (segment_) segment_->refresh();
        if (!refresh_timer_.isActive()) refresh_timer_.start();
        return;
      }
}

void PropertiesPanel::ask_values() {
  const int number = ++asked_;
  auto next = std::make_shared<std::vector<Shown>>();
  auto waiting = std::make_shared<std::size_t>(selection_.size());
  next->resize(selection_.size());
  const auto done = [this, number, next, waiting] {
    if (--*waiting > 0 || number != asked_) return;
    shown_ = std::move(*next);
    std::erase_if(shown_, [](const Shown& s) { return s.kind.empty(); });
    take_values();
  };
  for (std::size_t i = 0; i < selection_.size(); ++i) {
    (*next)[i].at = selection_[i];
    ask(client_, "record.describe", Map{{"id", selection_[i].record}}, this,
        [this, next, i, done](const Result<Value>& r) {
          Shown& s = (*next)[i];
          const Map* m = r.ok() ? r->as_map() : nullptr;
          if (!m) return done();
          s.described = *m;
          if (const Value* name = m->find("name")) s.name = name->text();
          if (const Value* kind = m->find("kind")) s.kind = kind->text();
          if (schemas_.contains(s.kind)) return done();
          ask(client_, "record.schema", Map{{"kind", s.kind}}, this,
              [this, kind = s.kind, done](const Result<Value>& about) {
                const Map* info = about.ok() ? about->as_map() : nullptr;
                const Value* form = info ? info->find("form") : nullptr;
                if (form)
                  if (auto schema = schema_from_values(*form); schema.ok())
                    schemas_[kind] = std::move(*schema);
                done();
              });
        });
  }
}

void PropertiesPanel::take_values() {
  for (Shown& s : shown_) {
    s.fields = fields_at(schemas_[s.kind], s.described, s.at.path);
    if (!s.fields) continue;
    s.computed = s.fields->values;
    if (s.at.path.empty()) add_parameters(*s.fields);
    const Value* expressions = s.described.find("expressions");
    if (!expressions || !expressions->as_map()) continue;
    for (const auto& [path, text] : *expressions->as_map()) {
      if (!text.as_string()) continue;
      std::string_view own = path;
      if (!s.at.path.empty()) {
        // Elements of lists are named in expressions.
        const Value* name = s.fields->values.find("name");
        const std::string by_name = name && name->as_string() ? *name->as_string() + "." : "";
        if (own.starts_with(s.at.path + ".")) own.remove_prefix(s.at.path.size() + 1);
        else if (!by_name.empty() && own.starts_with(by_name)) own.remove_prefix(by_name.size());
        else continue;
      }
      put_expression(s.fields->values, own, *text.as_string());
    }
  }
  std::erase_if(shown_, [](const Shown& s) { return !s.fields; });
  draw();
  if (!fault_timer_.isActive()) fault_timer_.start();
}

void PropertiesPanel::draw() {
  if (shown_.empty()) {
    end_drag(true);
    title_->setText(selection_.size() == 1 ? "It is gone" : "They are gone");
    drop_sections();
    subtitle_->clear();
    if (form_) form_->hide();
    if (joints_) joints_->deleteLater();
    joints_ = nullptr;
    return;
  }
  const Shown& first = shown_.front();
  // What all have in common.
  Schema common;
  for (const ParamSpec& p : first.fields->schema) {
    const bool in_all = std::all_of(shown_.begin(), shown_.end(), [&](const Shown& s) {
      const ParamSpec* other = find_param(s.fields->schema, p.name);
      return other && other->type == p.type && other->unit == p.unit;
    });
    if (in_all && !(shown_.size() > 1 && p.name == "name")) common.push_back(p);
  }
  std::string of = first.kind + " " + first.at.path + " " + first.fields->title + " " +
                   std::to_string(shown_.size());
  for (const ParamSpec& p : common) of += " " + p.name;
  for (const Shown& s : shown_) of += " " + std::to_string(s.at.record.number);
  if (shown_.size() == 1) {
    const bool is_part = !first.at.path.empty();
    const Value* own = first.fields->values.find("name");
    const bool has_name = own && own->as_string() && !own->as_string()->empty();
    title_->setText(qt(!is_part ? first.name : has_name ? *own->as_string() : first.at.path));
    subtitle_->setText(
        is_part
            ? qt((first.fields->title.empty() ? "in " : first.fields->title + " in ") + first.name)
            : qt(first.kind));
  } else {
    title_->setText(QString("%1 selected").arg(shown_.size()));
    subtitle_->setText(QString("%1 common fields").arg(common.size()));
  }
  if (!form_ || form_of_ != of) {
    end_drag(true);  // its field ends with the form
    if (form_) {
      form_->hide();
      form_->deleteLater();
    }
    form_of_ = of;
    context_ = std::make_shared<FormContext>();
    context_->client = &client_;
    context_->of = Map{{"kind", first.kind}};
    context_->title = "record.set";
    context_->takes_expressions = true;
    context_->also_given = Map{{"id", first.at.record}};
    context_->given = [this] { return form_ ? form_->values() : Map(); };
    context_->pose_of_view = pose_of_view;
    context_->parameter_names = [this] {
      QStringList names;
      const Value* all = shown_.empty() ? nullptr : shown_.front().described.find("parameters");
      if (all && all->as_map())
        for (const auto& [name, about] : *all->as_map()) names << qt(name);
      return names;
    };
    form_ = new SchemaForm(context_, std::move(common), first.at.path, page_);
    form_->on_change = [this](const std::string& path, const std::optional<Value>& value,
                              Field::Stage stage) { edit(path, value, static_cast<int>(stage)); };
    form_->on_remedy = [this](const FaultRemedy& remedy) {
      Map args = remedy.args;
      if (remedy.repeats) args.set("id", shown_.empty() ? Handle() : shown_.front().at.record);
      const std::string command = remedy.command.empty() ? "record.set" : remedy.command;
      ask(client_, command, std::move(args), this, [this](const Result<Value>& r) {
        if (!r.ok()) {
          outcome_->setText(qt(r.error().sentence()));
          outcome_->show();
        }
        refresh();
      });
    };
    column_->insertWidget(joints_ ? 1 : 0, form_);
  }
  form_->show();
  draw_joints();
  draw_sections();
  if (is_dragged_) ask_picture();
  // A value that is being dragged or typed is the user's.
  if (is_dragged_) {
    if (on_shown) on_shown();
    return;
  }
  Map values;
  std::vector<std::string> mixed;
  for (const ParamSpec& p : form_->schema()) {
    const Value* v = first.fields->values.find(p.name);
    const bool is_same = std::all_of(shown_.begin(), shown_.end(), [&](const Shown& s) {
      const Value* other = s.fields->values.find(p.name);
      return (!v && !other) || (v && other && *v == *other);
    });
    if (!is_same) mixed.push_back(p.name);
    else if (v && !(v->as_string() && v->as_string()->empty() &&
                    type_tree(p.type).kind != TypeKind::text))
      values.set(p.name, *v);
  }
  // Only fields that differ are set: the others may be in use.
  const Map now = form_->values();
  if (!(now == values)) {
    const auto is_typed = [](Field* f) {
      const auto* n = dynamic_cast<NumberField*>(f);
      return n && n->is_editing();
    };
    if (now.empty()) {
      form_->fill(values);
    } else {
      for (const ParamSpec& p : form_->schema()) {
        const Value *a = now.find(p.name), *b = values.find(p.name);
        if ((!a && !b) || (a && b && *a == *b) || is_typed(form_->field(p.name))) continue;
        form_->set(p.name, b ? std::optional(*b) : std::nullopt);
      }
    }
  }
  for (const ParamSpec& p : form_->schema())
    if (Field* f = form_->field(p.name)) {
      const bool is_mixed = std::find(mixed.begin(), mixed.end(), p.name) != mixed.end();
      if (f->is_mixed() != is_mixed) f->set_mixed(is_mixed);
      // What expressions give now.
      const Value* computed = first.computed.find(p.name);
      if (auto* n = dynamic_cast<NumberField*>(f); n && computed && computed->is_number())
        n->set_computed(computed->number());
      if (auto* v = dynamic_cast<VectorField*>(f); v && computed) {
        const auto parts = elements_of(*computed);
        for (std::size_t i = 0; i < parts.size(); ++i)
          if (parts[i].is_number()) v->set_computed(i, parts[i].number());
      }
    }
  if (on_shown) on_shown();
}

void PropertiesPanel::draw_joints() {
  const Shown& first = shown_.front();
  const Map& values = first.fields->values;
  const Value* name = values.find("name");
  const bool is_robot = shown_.size() == 1 && first.kind == "world" && !first.at.path.empty() &&
                        values.find("robot") && name && name->as_string() &&
                        first.described.find("robots");
  if (joints_ && (!is_robot || joints_->member() != *name->as_string() ||
                  !(joints_->world() == first.at.record))) {
    joints_->hide();
    joints_->deleteLater();
    joints_ = nullptr;
  }
  if (!is_robot) return;
  if (joints_) return joints_->refresh();
  joints_ = new JointSection(client_, first.at.record, *name->as_string(), page_);
  joints_->on_shown = [this] {
    if (on_shown) on_shown();
  };
  column_->insertWidget(0, joints_);
  joints_->show();
}

void PropertiesPanel::drop_sections() {
  for (QWidget* w : {static_cast<QWidget*>(mass_), static_cast<QWidget*>(users_),
                     static_cast<QWidget*>(segment_)})
    if (w) {
      w->hide();
      w->deleteLater();
    }
  mass_ = nullptr;
  users_ = nullptr;
  segment_ = nullptr;
}

void PropertiesPanel::draw_sections() {
  const Shown& first = shown_.front();
  const Handle& record = first.at.record;
  const auto is_of = [&](const std::vector<std::string_view>& kinds) {
    return shown_.size() == 1 && std::find(kinds.begin(), kinds.end(), first.kind) != kinds.end();
  };
  if (shown_.size() != 1) return drop_sections();
  const auto add = [this](QWidget* section) {
    column_->insertWidget(column_->indexOf(form_) + 1, section);
    section->show();
  };
  if (!users_ && first.at.path.empty() &&
      is_of({"material", "solid", "object", "robot", "trajectory"})) {
    users_ = new UsersSection(client_, record, page_);
    users_->on_go = [this](const Handle& h) {
      if (on_go) on_go(h);
    };
    column_->insertWidget(column_->indexOf(form_) + 1, users_);
  }
  if (!mass_ && is_of({"solid", "object"})) {
    mass_ = new MassSection(client_, record, qt(first.name), page_);
    mass_->on_shown = [this] {
      if (on_shown) on_shown();
    };
    add(mass_);
  }
  if (segment_ || !is_of({"trajectory"}) || !first.at.path.starts_with("segments")) return;
  const std::string_view rest = std::string_view(first.at.path).substr(8);
  std::optional<std::size_t> index = index_in_path(rest);
  const Value* all = first.described.find("segments");
  if (!index && rest.starts_with(".") && all && all->as_list())
    index = element_at(*all->as_list(), rest.substr(1));
  if (!index) return;
  segment_ = new SegmentSection(client_, record, first.name, static_cast<int>(*index) + 1, page_);
  segment_->on_shown = [this] {
    if (on_shown) on_shown();
  };
  add(segment_);
}

void PropertiesPanel::set_one(const Shown& shown, const std::string& path,
                              const std::optional<Value>& value, const ioci::Client::Edits& in) {
  const std::string whole = shown.at.path.empty() ? path : shown.at.path + "." + path;
  constexpr std::string_view kParameters = "parameters.";
  const bool is_parameter = whole.starts_with(kParameters);
  if (whole == "parameters") return set_parameters(shown, value);
  Map args{{"id", shown.at.record}};
  if (is_parameter) args.set("name", whole.substr(kParameters.size()));
  else args.set("path", whole);
  if (value) args.set("value", *value);
  const std::string command = is_parameter ? "record.set_parameter" : "record.set";
  const QPointer<PropertiesPanel> self = this;
  const auto done = [self, path](const Result<Value>& r) {
    if (!self) return;
    if (!r.ok() && r.error().code != ErrorCode::cancelled) self->show_refusal(path, r.error());
    if (r.ok()) {
      if (self->form_ && !self->is_dragged_) self->form_->clear_faults();
      self->outcome_->hide();
    }
  };
  if (in)
    client_.update(in, command, std::move(args), done,
                   std::to_string(shown.at.record.number) + whole);
  else client_.call(command, std::move(args), done);
}

void PropertiesPanel::set_parameters(const Shown& shown, const std::optional<Value>& value) {
  static const Map kNone;
  const Value* before = shown.fields->values.find("parameters");
  const Map& old = before && before->as_map() ? *before->as_map() : kNone;
  const Map& now = value && value->as_map() ? *value->as_map() : kNone;
  const auto report = [self = QPointer<PropertiesPanel>(this)](const Result<Value>& r) {
    if (self && !r.ok()) self->show_refusal("parameters", r.error());
  };
  for (const auto& [name, v] : old)
    if (!now.find(name))
      client_.call("record.remove_parameter", Map{{"id", shown.at.record}, {"name", name}}, report);
  for (const auto& [name, v] : now)
    if (const Value* same = old.find(name); !v.is_nil() && !(same && *same == v))
      client_.call("record.set_parameter",
                   Map{{"id", shown.at.record}, {"name", name}, {"value", v}}, report);
}

void PropertiesPanel::end_drag(bool keeps) {
  if (!std::exchange(is_dragged_, false)) return;
  const auto edits = std::exchange(gesture_, {});
  if (keeps) client_.commit(edits);
  else client_.cancel(edits);
}

void PropertiesPanel::edit(const std::string& path, const std::optional<Value>& value, int stage) {
  if (shown_.empty()) return;  // its drag has ended
  const std::string label =
      "set " + path + " of " +
      (shown_.size() == 1 ? shown_.front().name : std::to_string(shown_.size()) + " records");
  switch (static_cast<Field::Stage>(stage)) {
    case Field::Stage::drag_begun:
      end_drag(true);  // one of another field, whose end did not come
      gesture_ = client_.begin_gesture(label);
      is_dragged_ = true;
      if (mass_) mass_->keep_as_before();
      return;
    case Field::Stage::dragged:
      if (!is_dragged_) return;  // it has ended with the form or the selection
      for (const Shown& s : shown_) set_one(s, path, value, gesture_);
      return;
    case Field::Stage::drag_ended:
      end_drag(true);
      refresh_timer_.start();
      return;
    case Field::Stage::drag_cancelled:
      end_drag(false);
      refresh_timer_.start();
      return;
    case Field::Stage::changed: break;
  }
  if (shown_.size() == 1) {
    set_one(shown_.front(), path, value, {});
  } else {
    const auto edits = client_.begin_gesture(label);
    for (const Shown& s : shown_) set_one(s, path, value, edits);
    client_.commit(edits);
  }
}

void PropertiesPanel::show_refusal(const std::string& path, const Error& e) {
  if (!form_ || shown_.empty()) return;
  form_->clear_faults();
  std::vector<ShownFault> all;
  for (const Fault& f : faults_of(e)) {
    ShownFault one = shown_fault(f);
    // Arguments of record.set are about the value that was edited.
    one.path = path;
    for (FaultRemedy& r : one.remedies)
      if (r.repeats) {
        Map args{
            {"id", shown_.front().at.record},
            {"path", shown_.front().at.path.empty() ? path : shown_.front().at.path + "." + path}};
        for (const auto& [name, v] : r.args) args.set(name, v);
        r.args = std::move(args);
        r.repeats = false;
        r.command = "record.set";
      }
    all.push_back(std::move(one));
  }
  (void)form_->show_faults(all);
  outcome_->setText(qt(e.sentence()));
  outcome_->setVisible(all.empty());
  if (on_shown) on_shown();
}

void PropertiesPanel::ask_faults() {
  if (shown_.size() != 1 || !form_) return;
  const int number = asked_;
  const Shown& s = shown_.front();
  ask(client_, "fault.list", Map{{"record", s.at.record}, {"at_most", 20}}, this,
      [this, number, prefix = s.at.path](const Result<Value>& r) {
        if (number != asked_ || !form_ || !r.ok() || !r->as_map() || is_dragged_) return;
        const Value* list = r->as_map()->find("faults");
        if (!list || !list->as_list() || list->as_list()->empty()) return;
        std::vector<ShownFault> all;
        for (const Value& each : *list->as_list()) {
          const auto fault = fault_from(each);
          if (!fault) continue;
          ShownFault one = shown_fault(*fault);
          one.path = fault->subject.path;
          if (!prefix.empty()) {
            if (one.path == prefix) one.path.clear();
            else if (one.path.starts_with(prefix + "."))
              one.path = one.path.substr(prefix.size() + 1);
            else continue;
          }
          one.path = with_brackets(one.path);
          all.push_back(std::move(one));
        }
        form_->clear_faults();
        (void)form_->show_faults(all);
        if (on_shown) on_shown();
      });
}

void PropertiesPanel::ask_picture() {
  if (shown_.size() != 1 || shown_.front().kind != "material") return;
  // One at a time, so that those of a drag do not queue.
  if (is_drawing_) {
    is_picture_wanted_ = true;
    return;
  }
  is_drawing_ = true;
  const Handle record = shown_.front().at.record;
  const QString file = QDir::temp().filePath(QString("robomosp-material-%1-%2.png")
                                                 .arg(qulonglong(reinterpret_cast<quintptr>(this)))
                                                 .arg(++pictures_));
  const double ratio = devicePixelRatioF();
  const int side = static_cast<int>(theme().px(120) * ratio);
  const QPointer<PropertiesPanel> self = this;
  client_.start("material.render",
                Map{{"id", record},
                    {"file", file.toStdString()},
                    {"size", List{side * 4 / 3, side}},
                    {"quality", "draft"},
                    {"axes", false},
                    {"grid", false}},
                [self, record, file, ratio](const Result<Value>& r) {
                  QPixmap pixmap;
                  if (r.ok()) pixmap.load(file);
                  QFile::remove(file);
                  if (!self) return;
                  self->is_drawing_ = false;
                  const bool is_shown =
                      self->shown_.size() == 1 && self->shown_.front().at.record == record;
                  if (is_shown && !pixmap.isNull()) {
                    pixmap.setDevicePixelRatio(ratio);
                    self->picture_->setPixmap(pixmap);
                    self->picture_->show();
                    if (self->on_shown) self->on_shown();
                  }
                  if (std::exchange(self->is_picture_wanted_, false) || !is_shown)
                    self->ask_picture();
                });
}

}  // namespace robomosp::viewer
