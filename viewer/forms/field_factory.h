// SPDX-License-Identifier: GPL-3.0-or-later
// Makes the field for a type of the language of types (kernel/type.h) (layer: GUI).
#pragma once

#include <string>

#include "kernel/schema.h"
#include "kernel/type.h"
#include "viewer/forms/form_context.h"
#include "viewer/widgets/field.h"
#include "viewer/widgets/number_field.h"

namespace robomosp::viewer {

/// The field of a parameter at `path` of the form ("links[2].alpha"), described by label and doc.
/// Other types are typed as Lua. The caller owns it by `parent`.
[[nodiscard]] Field* make_field(const FormContextPtr& context, const ParamSpec& param,
                                const std::string& path, QWidget* parent);

/// The field for a value of a type that is given: without the line by which it is set and removed.
/// Not described yet.
[[nodiscard]] Field* make_part(const FormContextPtr& context, const TypeTree& type,
                               const ParamSpec& param, const std::string& path, QWidget* parent);

/// Unit, range and step of a number of a parameter; `unit` replaces that of the parameter unless
/// empty.
[[nodiscard]] NumberFormat number_format(const FormContext& context, const ParamSpec& param,
                                         std::string_view unit = {});
/// A short name of a type for a switch between alternatives: "numbers", "name of a pose".
[[nodiscard]] QString short_type_name(const TypeTree& type);

}  // namespace robomosp::viewer
