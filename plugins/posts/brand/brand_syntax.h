// SPDX-License-Identifier: Apache-2.0
// BrandSyntax: the spelling that each target of the brand writers has for itself, and the types
// that it can express (layer: plugins/posts, header only).
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <robomosp/sdk/post_writer.h>

namespace robomosp::post::brand {

/// Type of a variable of the target.
enum class Kind { none, integer, real, boolean, string, transform };

struct Bounds {
  std::int32_t lower = 0, upper = 0;
  [[nodiscard]] std::int64_t size() const { return std::int64_t{upper} - lower + 1; }
};
/// A part of a variable that has a name in the target.
struct Leaf {
  std::string suffix;
  std::uint32_t type = 0;
  std::vector<Bounds> bounds;
  std::vector<std::uint32_t> path;  ///< fields; RMP_NONE = an index
};

class BrandSyntax : public Writer {
 public:
  using Writer::Writer;

 protected:
  // ---- syntax of the target ----
  virtual std::string transform(const Pose&) = 0;
  virtual std::string translation(const std::string& x, const std::string& y,
                                  const std::string& z) = 0;
  /// Rotation about axis 0, 1, 2 by degrees.
  virtual std::string rotation(std::size_t axis, const std::string& degrees) = 0;
  virtual Text product(const Text& a, const Text& b) = 0;
  virtual Text inverse_of(const Text& a) = 0;
  /// x, y, z of a transform [mm].
  virtual std::string component(const std::string& of, std::size_t axis) = 0;
  virtual void set_component(const std::string& of, std::size_t axis, const std::string& to) = 0;
  virtual std::string element(const std::string& name, const std::vector<std::string>& indices,
                              const std::vector<Bounds>& bounds) = 0;
  virtual void assign_text(const std::string& place, Kind, const std::string& value) = 0;
  virtual void declare_leaf(const std::string& name, Kind, const std::vector<Bounds>&,
                            std::uint32_t routine) = 0;
  virtual std::string zero(Kind k) {
    switch (k) {
      case Kind::real: return "0.0";
      case Kind::boolean: return "FALSE";
      case Kind::string: return string_literal("").text;
      case Kind::transform: return transform(Pose{});
      default: return "0";
    }
  }
  virtual int most_dimensions() const { return 1; }
  /// Name of a variable from its wish; targets with type marks add them.
  virtual std::string spelled(std::uint32_t /*symbol*/, Kind, const std::string& name) {
    return name;
  }
  /// Waits for motions that run in parallel with the program.
  virtual void settle() {}

  static std::string plain(double v) {
    if (!std::isfinite(v)) return "0.0";
    return without_exponent(v);
  }
  /// Numbers without exponents, since not every controller reads those.
  std::string real_literal(double v) override { return plain(v); }

  // ---- types ----
  [[nodiscard]] Kind kind(std::uint32_t t) const {
    switch (type(t).kind) {
      case RMP_TYPE_INT: return Kind::integer;
      case RMP_TYPE_REAL: return Kind::real;
      case RMP_TYPE_BOOL: return Kind::boolean;
      case RMP_TYPE_STRING: return Kind::string;
      default: break;
    }
    const std::uint32_t r = role(t);
    return r == RMP_ROLE_POSITION || r == RMP_ROLE_ORIENTATION || r == RMP_ROLE_POSE
               ? Kind::transform
               : Kind::none;
  }
  /// Parts of a type; empty = it cannot be expressed.
  std::optional<std::vector<Leaf>> leaves(std::uint32_t t) {
    std::vector<Leaf> out;
    std::vector<std::pair<std::uint32_t, Leaf>> open{{t, {}}};
    while (!open.empty()) {
      auto [at, so_far] = std::move(open.back());
      open.pop_back();
      if (kind(at) != Kind::none) {
        so_far.type = at;
        if (so_far.bounds.size() > static_cast<std::size_t>(most_dimensions())) return std::nullopt;
        out.push_back(std::move(so_far));
      } else if (type(at).kind == RMP_TYPE_ARRAY) {
        so_far.bounds.push_back({type(at).lower, type(at).upper});
        so_far.path.push_back(RMP_NONE);
        open.emplace_back(type(at).element, std::move(so_far));
      } else if (type(at).kind == RMP_TYPE_RECORD && role(at) == RMP_ROLE_NONE) {
        for (std::uint32_t k = type(at).field_count; k-- > 0;) {
          Leaf next = so_far;
          next.suffix += std::string("_") + field_row(type(at).first_field + k).name;
          next.path.push_back(k);
          open.emplace_back(field_row(type(at).first_field + k).type, std::move(next));
        }
      } else {
        return std::nullopt;
      }
      if (out.size() > 1000) return std::nullopt;
    }
    return out;
  }

  /// True if it depends on signals and constants only.
  bool is_of_signals_only(std::uint32_t e) const {
    std::vector<std::uint32_t> open{e};
    while (!open.empty()) {
      const auto& x = expression(open.back());
      open.pop_back();
      if (x.constant != RMP_NONE) continue;
      if (x.op == RMP_EXPR_SYMBOL &&
          (x.symbol == RMP_NONE || symbol(x.symbol).kind != RMP_SYMBOL_INPUT))
        return false;
      if (x.op == RMP_EXPR_CALL || x.op == RMP_EXPR_INTRINSIC) return false;
      for (const std::uint32_t o : links(x.first, x.count)) open.push_back(o);
    }
    return true;
  }
};

}  // namespace robomosp::post::brand
