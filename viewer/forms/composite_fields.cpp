// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/forms/composite_fields.h"

#include <algorithm>
#include <utility>

#include <QHBoxLayout>
#include <QLabel>
#include <QMenu>
#include <QPushButton>
#include <QToolButton>
#include <QVBoxLayout>

#include "kernel/literal.h"
#include "kernel/type_forms.h"
#include "viewer/forms/field_buttons.h"
#include "viewer/forms/field_factory.h"
#include "viewer/forms/schema_form.h"
#include "viewer/theme/icons.h"
#include "viewer/theme/theme.h"
#include "viewer/widgets/choice_field.h"
#include "viewer/widgets/number_fields.h"
#include "viewer/widgets/simple_fields.h"

namespace robomosp::viewer {
namespace {

constexpr std::size_t kLongestSummary = 80;
constexpr std::string_view kParams = ".params.";

/// A value without the marks of Lua: "0, 0, 0.2", "name: home".
QString plain_text(const Value& v) {
  if (v.as_string()) return qt(*v.as_string());
  if (v.is_number()) return number_text(v.number());
  if (v.as_bool()) return *v.as_bool() ? QStringLiteral("yes") : QStringLiteral("no");
  QStringList parts;
  if (v.as_list() || v.as_array())
    for (const Value& each : elements_of(v)) parts << plain_text(each);
  if (const Map* m = v.as_map())
    for (const auto& [name, each] : *m) parts << qt(name) + ": " + plain_text(each);
  if (v.as_list() || v.as_array() || v.as_map()) return parts.join(v.as_map() ? " · " : ", ");
  return qt(v.text());
}

/// One line about a value that is not shown as a field.
QString summary_of(const Value& v) {
  const auto count = [](std::size_t n, const char* one, const char* many) {
    return QString("%1 %2").arg(n).arg(n == 1 ? one : many);
  };
  if (const List* list = v.as_list();
      list && (list->size() > 6 || std::any_of(list->begin(), list->end(), [](const Value& e) {
                 return e.as_map() || e.as_list();
               })))
    return count(list->size(), "element", "elements");
  if (const Map* m = v.as_map(); m && m->size() > 4) {
    if (const Value* name = m->find("name"); name && name->as_string())
      return qt(*name->as_string());
    return count(m->size(), "field", "fields");
  }
  if (const NumericArray* a = v.as_array(); a && a->size() > 8)
    return a->is_matrix() ? QString("%1 × %2 numbers").arg(a->rows()).arg(a->cols())
                          : count(a->size(), "number", "numbers");
  if ((v.as_map() && v.as_map()->empty()) || (v.as_list() && v.as_list()->empty()))
    return QStringLiteral("none");
  if (const std::string* s = v.as_string(); s && s->size() > kLongestSummary)
    return qt(s->substr(0, kLongestSummary)) + "…";
  const QString text = plain_text(v);
  return text.size() > static_cast<qsizetype>(kLongestSummary)
             ? text.left(static_cast<qsizetype>(kLongestSummary)) + "…"
             : text;
}

/// Whether a value of a type is shown as its field as soon as it is given: those of a few lines.
bool is_compact(const TypeTree& t) {
  switch (t.kind) {
    case TypeKind::boolean:
    case TypeKind::integer:
    case TypeKind::real:
    case TypeKind::expression:
    case TypeKind::text:
    case TypeKind::word:
    case TypeKind::path:
    case TypeKind::vector:
    case TypeKind::joints:
    case TypeKind::pose:
    case TypeKind::reference:
    case TypeKind::member:
    case TypeKind::colour: return true;
    case TypeKind::named: {
      const TypeTree* named = named_type(t.word);
      return named && named->kind != TypeKind::one_of && is_compact(*named);
    }
    default: return false;
  }
}

/// Whether the field of a type can show a value without losing a part of it.
bool can_show(const TypeTree& t, const Value& v) {
  const auto are_leaves = [](const std::vector<Value>& parts) {
    return std::none_of(parts.begin(), parts.end(),
                        [](const Value& e) { return e.as_list() || e.as_map() || e.as_array(); });
  };
  switch (t.kind) {
    case TypeKind::boolean: return v.as_bool() != nullptr;
    case TypeKind::integer:
    case TypeKind::real:
    case TypeKind::expression: return v.is_number() || v.as_string();
    case TypeKind::text:
    case TypeKind::script:
    case TypeKind::path:
    case TypeKind::word: return v.as_string() != nullptr;
    case TypeKind::reference:
    case TypeKind::member: return v.as_string() || v.as_handle();
    case TypeKind::vector:
    case TypeKind::joints:
      return (v.as_list() || (v.as_array() && !v.as_array()->is_matrix())) &&
             are_leaves(elements_of(v)) && (t.count == 0 || elements_of(v).size() == t.count);
    case TypeKind::matrix: {
      if (v.as_array()) return v.as_array()->is_matrix();
      if (!v.as_list()) return false;
      std::size_t cols = 0;
      for (const Value& row : *v.as_list()) {
        const auto parts = elements_of(row);
        if ((!row.as_list() && !row.as_array()) || !are_leaves(parts)) return false;
        if (cols != 0 && parts.size() != cols) return false;
        cols = parts.size();
      }
      return true;
    }
    case TypeKind::pose: return !v.as_string();
    case TypeKind::list:
    case TypeKind::table: return v.as_list() || (v.as_array() && !v.as_array()->is_matrix());
    case TypeKind::map:
    case TypeKind::variant: return v.as_map() || (v.as_list() && v.as_list()->empty());
    case TypeKind::provider: {
      if (v.as_string()) return true;
      const Map* m = v.as_map();
      return m && m->find("name");
    }
    case TypeKind::colour: return true;
    case TypeKind::named: {
      const TypeTree* named = named_type(t.word);
      if (!named) return false;
      if (named->kind == TypeKind::one_of)
        return std::any_of(named->options.begin(), named->options.end(),
                           [&](const auto& o) { return can_show(*o, v); });
      return can_show(*named, v);
    }
    default: return false;
  }
}

/// What a new value of a type begins with; nothing = an empty field.
std::optional<Value> first_value(const TypeTree& t) {
  switch (t.kind) {
    case TypeKind::list:
    case TypeKind::table: return Value(List());
    case TypeKind::map:
    case TypeKind::variant: return Value(Map());
    case TypeKind::pose:
      return Value(Map{{"position", List{0.0, 0.0, 0.0}}, {"rpy", List{0.0, 0.0, 0.0}}});
    default: return std::nullopt;
  }
}

}  // namespace

QToolButton* small_button(QWidget* parent, const char* symbol, const QString& tip,
                          const QString& name) {
  auto* b = new QToolButton(parent);
  b->setIcon(icon(symbol));
  b->setFixedSize(theme().field_height, theme().field_height);
  b->setToolTip(tip);
  b->setAccessibleName(tip);
  b->setObjectName(name);
  return b;
}

QPushButton* link_button(QWidget* parent, const QString& text, const QString& tip,
                         const QString& name) {
  auto* b = new QPushButton(text, parent);
  b->setProperty("link", true);
  b->setToolTip(tip);
  b->setAccessibleName(tip);
  b->setObjectName(name);
  return b;
}

QVBoxLayout* column_of(QWidget* widget) {
  auto* column = new QVBoxLayout(widget);
  column->setContentsMargins(0, 0, 0, 0);
  column->setSpacing(theme().px(4));
  return column;
}

void ask_material_looks(ChoiceField* field, const FormContextPtr& context) {
  if (!context->client) return;
  field->set_look([context, field](const Value& choice, std::function<void(ChoiceLook)> answer) {
    ask(*context->client, "material.describe", Map{{"id", choice}}, field,
        [answer = std::move(answer)](const Result<Value>& r) {
          const Map* m = r.ok() ? r->as_map() : nullptr;
          const Value* colour = m ? m->find("colour") : nullptr;
          const Value* density = m ? m->find("density") : nullptr;
          if (!colour) return;
          ChoiceLook look;
          look.swatch = colour_of(*colour).value_or(QColor());
          if (density && density->is_number())
            look.doc = number_text(density->number()) + QStringLiteral(" kg/m³");
          answer(look);
        });
  });
}

void ask_choices(ChoiceField* field, const FormContextPtr& context, const std::string& path) {
  if (!context->client) return;
  field->set_ask([context, path, field](const QString&, ChoiceField::Answer answer) {
    Map args = context->of;
    args.set("argument", path);
    Map given = context->given ? context->given() : Map();
    for (const auto& [name, value] : context->also_given)
      if (!given.find(name)) given.set(name, value);
    args.set("given", std::move(given));
    ask(*context->client, "schema.choices", std::move(args), field,
        [answer = std::move(answer)](const Result<Value>& r) {
          std::vector<FieldChoice> out;
          if (!r.ok()) {
            out.push_back({Value(), "", {}, qt(r.error().sentence())});
          } else if (const List* list = r->as_list()) {
            for (const Value& each : *list) {
              const Map* m = each.as_map();
              if (!m) continue;
              const auto text = [m](const char* name) {
                const Value* v = m->find(name);
                return v && v->as_string() ? qt(*v->as_string()) : QString();
              };
              out.push_back({m->find("value") ? *m->find("value") : Value(), text("label"),
                             text("doc"), text("why_not")});
            }
          }
          answer(std::move(out));
        });
  });
}

// ---- OptionsField ----

OptionsField::OptionsField(FormContextPtr context, ParamSpec param, std::string path,
                           QWidget* parent)
    : Field(parent),
      context_(std::move(context)),
      param_(std::move(param)),
      path_(std::move(path)),
      column_(column_of(this)) {
  const TypeTree& t = type_tree(param_.type);
  if (t.kind == TypeKind::one_of)
    for (const auto& option : t.options) types_.push_back(option.get());
  else types_.push_back(&t);
  const Theme& th = theme();
  head_ = new QWidget(this);
  auto* row = new QHBoxLayout(head_);
  row->setContentsMargins(0, 0, 0, 0);
  row->setSpacing(th.px(4));
  const QString name = qt(context_->title + "." + path_);
  head_->setObjectName(name + ".head");
  head_->setAccessibleName("Value and its parts");
  fold_ = small_button(head_, "chevron_right", "Show the parts", name + ".fold");
  line_ = new QLabel(head_);
  line_->setObjectName(name + ".line");
  line_->setTextInteractionFlags(Qt::NoTextInteraction);
  line_->setSizePolicy(QSizePolicy::Ignored, QSizePolicy::Preferred);
  switch_ = link_button(head_, {}, "Choose the form in which the value is given", name + ".as");
  set_ = link_button(head_, "Set", "Give a value", name + ".set");
  remove_ = small_button(head_, "close", "Remove the value", name + ".remove");
  row->addWidget(fold_);
  row->addWidget(line_, 1);
  row->addWidget(switch_);
  row->addWidget(set_);
  row->addWidget(remove_);
  column_->addWidget(head_);
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Preferred);
  QObject::connect(fold_, &QToolButton::clicked, this, [this] {
    if (editor_ && editor_->isVisibleTo(this)) {
      value_ = value();
      drop_editor();
    } else {
      open_editor(false);
    }
    show_line();
  });
  QObject::connect(set_, &QPushButton::clicked, this, [this] { open_editor(!value()); });
  QObject::connect(remove_, &QToolButton::clicked, this, [this] {
    drop_editor();
    value_.reset();
    last_path_.clear();
    show_line();
    notify(Stage::changed);
  });
  QObject::connect(switch_, &QPushButton::clicked, this, [this] {
    auto* menu = new QMenu(this);
    menu->setAttribute(Qt::WA_DeleteOnClose);
    menu->setObjectName(objectName() + ".forms");
    for (std::size_t i = 0; i < option_count(); ++i) {
      QAction* a =
          menu->addAction(i < types_.size() ? short_type_name(*types_[i]) : QString("as Lua"));
      a->setCheckable(true);
      a->setChecked(i == option_);
      QObject::connect(a, &QAction::triggered, this, [this, i] { show_option(i); });
    }
    menu->popup(switch_->mapToGlobal(QPoint(0, switch_->height())));
  });
  show_line();
}

bool OptionsField::is_tall() const { return editor_ && (!is_inline_ || editor_->is_tall()); }

ParamSpec OptionsField::param_of(std::size_t index) const {
  ParamSpec p = param_;
  p.type = type_text(*types_[index]);
  p.default_value.reset();
  if (!types_[index]->unit.empty()) p.unit.clear();
  return p;
}

void OptionsField::make_editor() {
  drop_editor();
  if (option_ >= types_.size()) {
    editor_ = new LiteralField(this);
  } else {
    const ParamSpec p = param_of(option_);
    editor_ = make_part(context_, type_tree(p.type), p, path_, this);
  }
  editor_->describe(accessibleName(), accessibleDescription(), {}, objectName() + ".value");
  editor_->on_change = [this](Stage stage) {
    is_edited_ = true;
    last_path_ = editor_->changed_path();
    set_fault({});
    show_line();
    notify(stage);
  };
  // A field of one line takes the place of the text.
  auto* line = static_cast<QHBoxLayout*>(head_->layout());
  is_inline_ = !editor_->is_tall() && option_ < types_.size() && is_compact(*types_[option_]);
  if (is_inline_) line->insertWidget(line->indexOf(line_), editor_, 1);
  else column_->addWidget(editor_);
  line_->setVisible(!is_inline_);
  editor_->show();
}

void OptionsField::drop_editor() {
  line_->show();
  is_inline_ = false;
  if (!editor_) return;
  editor_->hide();
  editor_->deleteLater();
  editor_ = nullptr;
  is_edited_ = false;
}

void OptionsField::set_always_open() {
  is_always_open_ = true;
  open_editor(false);
  show_line();
}

void OptionsField::open_editor(bool is_edit) {
  std::optional<Value> start = value_;
  if (!start && is_edit && default_ && !default_->is_nil()) start = default_;
  if (!start && is_edit && option_ < types_.size()) {
    const TypeTree* t = types_[option_];
    if (t->kind == TypeKind::named)
      if (const TypeTree* named = named_type(t->word)) t = named;
    start = first_value(*t);
  }
  make_editor();
  editor_->set_value(start);
  if (is_edit) {
    is_edited_ = true;
    last_path_.clear();
    editor_->setFocus(Qt::OtherFocusReason);
  }
  show_line();
  if (is_edit && start) notify(Stage::changed);
}

void OptionsField::show_option(std::size_t index) {
  const auto now = value();
  option_ = std::min(index, types_.size());
  value_ = now;
  make_editor();
  // The value stays where the other form can show it.
  if (now && (option_ >= types_.size() || can_show(*types_[option_], *now)))
    editor_->set_value(now);
  else is_edited_ = true;
  show_line();
  if (is_edited_) notify(Stage::changed);
}

void OptionsField::show_line() {
  const auto now = value();
  const bool is_open = editor_ != nullptr;
  fold_->setIcon(icon(is_open ? "chevron_down" : "chevron_right"));
  fold_->setToolTip(is_open ? "Fold the parts" : "Show the parts");
  fold_->setAccessibleName(fold_->toolTip());
  // An empty list has nothing to unfold or remove, so it reads like a value that is not given.
  const bool is_empty = now && ((now->as_list() && now->as_list()->empty()) ||
                                (now->as_map() && now->as_map()->empty()));
  fold_->setVisible(((now && !is_empty) || is_open) && !is_always_open_ && !is_inline_);
  set_->setVisible((!now || is_empty) && !is_open);
  remove_->setVisible(((now && !is_empty) || is_open) && !is_always_open_ && !param_.required);
  switch_->setVisible(is_open || types_.size() > 1);
  switch_->setText(option_ < types_.size() ? short_type_name(*types_[option_]) : QString("as Lua"));
  QString text;
  bool is_quiet = true;
  if (is_open) {
    text.clear();
  } else if (is_mixed()) {
    text = "several values";
  } else if (now) {
    text = summary_of(*now);
    is_quiet = false;
  } else if (default_ && !default_->is_nil()) {
    text = summary_of(*default_);
  } else {
    text = source().isEmpty() ? QString("none") : source();
  }
  line_->setText(text);
  line_->setProperty("quiet", is_quiet);
  line_->setAccessibleName(accessibleName() + ": " + text);
  line_->setToolTip(toolTip());
  updateGeometry();
  if (std::exchange(was_open_, is_open) != is_open && on_height) on_height();
}

std::optional<Value> OptionsField::value() const {
  return editor_ && is_edited_ ? editor_->value() : value_;
}

void OptionsField::set_value(const std::optional<Value>& value) {
  // A long list is opened by the user only.
  constexpr std::size_t kLongList = 16;
  const bool is_long = value && value->as_list() && value->as_list()->size() > kLongList;
  const bool was_open = editor_ != nullptr && !is_long;
  value_ = value;
  is_edited_ = false;
  std::size_t next = option_;
  if (value) {
    next = types_.size();
    for (std::size_t i = 0; i < types_.size() && next == types_.size(); ++i)
      if (can_show(*types_[i], *value) && misfit(*types_[i], *value, "").empty()) next = i;
    for (std::size_t i = 0; i < types_.size() && next == types_.size(); ++i)
      if (can_show(*types_[i], *value)) next = i;
  }
  if (was_open && next == option_ && value) {
    editor_->set_value(value);
  } else {
    option_ = next;
    drop_editor();
    const bool opens = value && option_ < types_.size() && is_compact(*types_[option_]);
    if ((was_open && value) || is_always_open_ || opens) open_editor(false);
  }
  show_line();
}

void OptionsField::set_default(const std::optional<Value>& value) {
  Field::set_default(value);
  show_line();
}

bool OptionsField::place_fault(std::string_view path, const QString& sentence) {
  if (!path.empty() && value() && !editor_) open_editor(false);
  if (editor_ && editor_->place_fault(path, sentence)) return true;
  return Field::place_fault(path, sentence);
}

void OptionsField::clear_faults() {
  Field::clear_faults();
  if (editor_) editor_->clear_faults();
}

std::vector<PartFault> OptionsField::shown_faults() const {
  return editor_ ? editor_->shown_faults() : Field::shown_faults();
}

bool OptionsField::shows_sentence(std::string_view path) const {
  return editor_ && editor_->shows_sentence(path);
}

QString OptionsField::unit_beside() const { return editor_ ? editor_->unit_beside() : QString(); }

std::string OptionsField::changed_path() const { return last_path_; }

std::optional<Value> OptionsField::changed_value() const {
  if (last_path_.empty() || !editor_) return value();
  return editor_->changed_value();
}

// ---- FieldsField ----

FieldsField::FieldsField(FormContextPtr context, const TypeTree& tree, std::string path,
                         QWidget* parent)
    : Field(parent),
      context_(std::move(context)),
      tree_(tree),
      path_(std::move(path)),
      column_(column_of(this)) {
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Preferred);
  if (tree_.kind != TypeKind::variant) {
    show_case({}, {});
    return;
  }
  decides_ = new ChoiceField(this);
  decides_->set_may_be_empty(false);
  std::vector<FieldChoice> words;
  for (const auto& [word, fields] : tree_.cases)
    words.push_back({Value(word), qt(word_label({word})), {}, {}});
  decides_->set_choices(std::move(words));
  decides_->describe(qt(tree_.decided_by), "Decides which fields follow.", qt(context_->title),
                     qt(context_->title + "." + path_ + "." + tree_.decided_by));
  column_->addWidget(decides_);
  decides_->on_change = [this](Stage stage) {
    const auto word = decides_->value();
    // Values that the new case has, too, stay.
    const Map kept = form_ ? form_->values() : Map();
    show_case(word && word->as_string() ? *word->as_string() : std::string(), kept);
    is_given_ = true;
    last_path_.clear();
    last_value_ = value();
    notify(stage);
  };
}

void FieldsField::show_case(const std::string& word, const Map& values) {
  const Schema* fields = tree_.kind == TypeKind::variant ? nullptr : &tree_.fields;
  for (const auto& [name, schema] : tree_.cases)
    if (name == word) fields = &schema;
  if (form_) {
    form_->hide();
    form_->deleteLater();
    form_ = nullptr;
  }
  if (!fields) return;
  form_ = new SchemaForm(context_, *fields, path_, this);
  Map known;
  for (const auto& [name, value] : values)
    if (find_param(*fields, name)) known.set(name, value);
  form_->fill(known);
  form_->on_change = [this](const std::string& path, const std::optional<Value>& v, Stage stage) {
    is_given_ = true;
    last_path_ = "." + path;
    last_value_ = v;
    notify(stage);
  };
  column_->addWidget(form_);
  form_->show();
}

std::optional<Value> FieldsField::value() const {
  if (!is_given_) return std::nullopt;
  Map out;
  if (decides_)
    if (const auto word = decides_->value()) out.set(tree_.decided_by, *word);
  if (form_)
    for (const auto& [name, v] : form_->values()) out.set(name, v);
  for (const auto& [name, v] : others_) out.set(name, v);
  return Value(std::move(out));
}

void FieldsField::set_value(const std::optional<Value>& value) {
  static const Map kNone;
  is_given_ = value.has_value();
  const Map& m = value && value->as_map() ? *value->as_map() : kNone;
  if (decides_) {
    const Value* word = m.find(tree_.decided_by);
    const auto before = decides_->value();
    decides_->set_value(word ? std::optional(*word) : std::nullopt);
    const bool is_same = form_ && word && before && *before == *word;
    if (!is_same) show_case(word && word->as_string() ? *word->as_string() : std::string(), m);
  }
  others_ = Map();
  Map known;
  for (const auto& [name, v] : m) {
    if (form_ && find_param(form_->schema(), name)) known.set(name, v);
    else if (name != tree_.decided_by) others_.set(name, v);
  }
  if (form_) form_->fill(known);
}

bool FieldsField::place_fault(std::string_view path, const QString& sentence) {
  if (path.size() > 1 && path.front() == '.') {
    path.remove_prefix(1);
    if (decides_ && path == tree_.decided_by) {
      decides_->set_fault(sentence);
      return true;
    }
    if (form_ && form_->show_faults({{std::string(path), sentence, {}}})) return true;
  }
  return Field::place_fault(path, sentence);
}

std::vector<PartFault> FieldsField::shown_faults() const {
  std::vector<PartFault> out;
  if (decides_ && !decides_->fault().isEmpty())
    out.push_back({"." + tree_.decided_by, decides_->fault()});
  if (form_)
    for (PartFault& each : form_->field_faults())
      out.push_back({"." + each.path, std::move(each.sentence)});
  return out.empty() ? Field::shown_faults() : out;
}

bool FieldsField::shows_sentence(std::string_view path) const {
  if (!form_ || path.size() < 2 || path.front() != '.') return false;
  path.remove_prefix(1);
  return find_param(form_->schema(), path.substr(0, std::min(path.find('.'), path.find('[')))) !=
         nullptr;
}

void FieldsField::clear_faults() {
  Field::clear_faults();
  if (decides_) decides_->clear_faults();
  if (form_) form_->clear_faults();
}

// ---- ProviderField ----

ProviderField::ProviderField(FormContextPtr context, const TypeTree& tree, std::string path,
                             QWidget* parent)
    : Field(parent),
      context_(std::move(context)),
      tree_(tree),
      path_(std::move(path)),
      choice_(new ChoiceField(this)),
      column_(column_of(this)) {
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Preferred);
  setFocusProxy(choice_);
  choice_->set_takes_text(true);
  ask_choices(choice_, context_, path_);
  column_->addWidget(choice_);
  choice_->on_change = [this](Stage stage) {
    value_.reset();
    params_ = Map();
    ask_params({});
    notify(stage);
  };
  QObject::connect(this, &QObject::objectNameChanged, this, [this](const QString& name) {
    choice_->describe(accessibleName(), accessibleDescription(), toolTip(), name + ".name");
  });
}

std::optional<Value> ProviderField::value() const {
  if (value_) return value_;
  const auto name = choice_->value();
  if (!name) return std::nullopt;
  const Map params = form_ ? form_->values() : params_;
  if (params.empty()) return name;
  return Value(Map{{"name", *name}, {"params", params}});
}

void ProviderField::set_value(const std::optional<Value>& value) {
  value_ = value;
  params_ = Map();
  std::optional<Value> name = value;
  if (value && value->as_map()) {
    const Value* n = value->as_map()->find("name");
    name = n ? std::optional(*n) : std::nullopt;
    if (const Value* p = value->as_map()->find("params"); p && p->as_map()) params_ = *p->as_map();
  }
  const auto before = choice_->value();
  choice_->set_value(name);
  if (form_ && before == name) form_->fill(params_);
  else ask_params(params_);
}

void ProviderField::set_default(const std::optional<Value>& value) {
  Field::set_default(value);
  choice_->set_default(value);
}

void ProviderField::ask_params(const Map& values) {
  const int number = ++asked_;
  if (form_) {
    form_->hide();
    form_->deleteLater();
    form_ = nullptr;
  }
  const auto name = choice_->value();
  if (!name || !name->as_string() || name->as_string()->empty() || !context_->client) return;
  // Of several interfaces the one that has a provider of this name.
  for (const std::string& word : tree_.words)
    ask(*context_->client, "provider.params", Map{{"interface", word}, {"name", *name}}, this,
        [this, number, values](const Result<Value>& r) {
          if (number != asked_ || !r.ok() || form_) return;
          if (const auto schema = schema_from_values(*r); schema.ok() && !schema->empty())
            take_schema(*schema, values);
        });
}

void ProviderField::take_schema(const Schema& schema, const Map& values) {
  form_ = new SchemaForm(context_, schema, path_ + ".params", this);
  form_->fill(values);
  form_->on_change = [this](const std::string&, const std::optional<Value>&, Stage stage) {
    value_.reset();
    notify(stage);
  };
  column_->addWidget(form_);
  form_->show();
  updateGeometry();
  if (on_height) on_height();
}

std::vector<PartFault> ProviderField::shown_faults() const {
  std::vector<PartFault> out;
  if (form_)
    for (PartFault& each : form_->field_faults())
      out.push_back({".params." + each.path, std::move(each.sentence)});
  return out.empty() ? Field::shown_faults() : out;
}

bool ProviderField::shows_sentence(std::string_view path) const {
  return form_ && path.starts_with(kParams) &&
         find_param(form_->schema(),
                    path.substr(kParams.size(), path.find_first_of(".[", kParams.size()) -
                                                    kParams.size())) != nullptr;
}

bool ProviderField::place_fault(std::string_view path, const QString& sentence) {
  if (path.starts_with(kParams) && form_ &&
      form_->show_faults({{std::string(path.substr(kParams.size())), sentence, {}}}))
    return true;
  choice_->set_fault(sentence);
  return Field::place_fault(path, sentence);
}

void ProviderField::clear_faults() {
  Field::clear_faults();
  choice_->clear_faults();
  if (form_) form_->clear_faults();
}

}  // namespace robomosp::viewer
