// SPDX-License-Identifier: Apache-2.0
// Texts, lists and files of a machine, and values as text.
#include <algorithm>
#include <charconv>

#include "program/state.h"

namespace robomosp::program {

std::string_view Run::text_of(Slot s) const {
  if ((s.bits & kTagMask) != kTextTag) return {};
  const auto i = static_cast<std::uint32_t>(s.bits);
  if (s.bits & kConstantText)
    return i < c_.constant_texts.size() ? std::string_view(c_.constant_texts[i])
                                        : std::string_view();
  if (i >= s_.heap.texts.size() || !s_.heap.texts[i].text) return {};
  return *s_.heap.texts[i].text;
}

Slot Run::new_text(std::string text) {
  if (text.empty()) return {};
  Heap& h = s_.heap;
  h.bytes += text.size() + 48;
  auto kept = std::make_shared<const std::string>(std::move(text));
  std::uint32_t i = 0;
  if (!h.free_texts.empty()) {
    i = h.free_texts.back();
    h.free_texts.pop_back();
    h.texts[i].text = std::move(kept);
  } else {
    i = static_cast<std::uint32_t>(h.texts.size());
    h.texts.push_back({std::move(kept), false});
  }
  return {kTextTag | i};
}

const Heap::List* Run::list_of(Slot s) const {
  if ((s.bits & kTagMask) != kListTag) return nullptr;
  const auto i = static_cast<std::uint32_t>(s.bits);
  if (i >= s_.heap.lists.size() || !s_.heap.lists[i].is_used) return nullptr;
  return &s_.heap.lists[i];
}
Heap::List* Run::list_of(Slot s) {
  return const_cast<Heap::List*>(static_cast<const Run*>(this)->list_of(s));
}

Slot Run::new_list() {
  Heap& h = s_.heap;
  h.bytes += 64;
  std::uint32_t i = 0;
  if (!h.free_lists.empty()) {
    i = h.free_lists.back();
    h.free_lists.pop_back();
  } else {
    i = static_cast<std::uint32_t>(h.lists.size());
    h.lists.emplace_back();
  }
  h.lists[i].is_used = true;
  h.lists[i].slots.clear();
  return {kListTag | i};
}

Slot* Run::at(Process& p, std::uint64_t address, std::uint64_t count, bool writes) {
  if (address & kListAddress) {
    const std::uint64_t list = (address & ~kListAddress) >> 32, offset = address & 0xffff'ffffu;
    if (list >= s_.heap.lists.size() || !s_.heap.lists[list].is_used) return nullptr;
    auto& slots = s_.heap.lists[list].slots;
    return offset + count <= slots.size() ? slots.data() + offset : nullptr;
  }
  if (address & kConstantAddress) {
    const std::uint64_t offset = address & ~kConstantAddress;
    if (writes || offset + count > c_.constants.size()) return nullptr;
    return const_cast<Slot*>(c_.constants.data()) + offset;
  }
  if (address < s_.globals.size())
    return address + count <= s_.globals.size() ? s_.globals.data() + address : nullptr;
  address -= s_.globals.size();
  if (address > p.stack.size() || count > p.stack.size() - address) return nullptr;
  return p.stack.data() + address;
}

bool Run::has_room(std::uint64_t more) {
  if (s_.heap.bytes + more <= s_.heap.collect_at) return true;
  if (bytes() + more > c_.limits.most_bytes) collect();
  if (bytes() + more <= c_.limits.most_bytes) return true;
  return fail(
      "the program needs more than the " + std::to_string(c_.limits.most_bytes) + " bytes allowed",
      "Look for a list, a string or a recursion that grows without limit.");
}

bool Run::deepen(Process& p, std::uint32_t type, std::uint64_t address) {
  const TypeInfo& t = c_.types[type];
  if (!t.has_list) return true;
  if (t.kind == RMP_TYPE_LIST) {
    Slot* s = at(p, address, 1, true);
    if (!s) return true;
    const Heap::List* from = list_of(*s);
    if (!from) {
      *s = {};
      return true;
    }
    if (!has_room(from->slots.size() * 8)) return false;
    cost_ += from->slots.size() / 8 + 1;
    const std::vector<Slot> slots = from->slots;
    const Slot copy = new_list();
    s_.heap.bytes += slots.size() * 8;
    list_of(copy)->slots = slots;
    if (Slot* again = at(p, address, 1, true)) *again = copy;
    const TypeInfo& e = c_.types[t.element];
    if (!e.has_list || e.slots == 0) return true;
    const std::uint64_t first =
        kListAddress | (static_cast<std::uint64_t>(static_cast<std::uint32_t>(copy.bits)) << 32);
    for (std::size_t k = 0; k + e.slots <= slots.size(); k += e.slots)
      if (!deepen(p, t.element, first + k)) return false;
    return true;
  }
  if (t.kind == RMP_TYPE_ARRAY) {
    for (std::uint32_t k = 0; k < t.length; ++k)
      if (!deepen(p, t.element, address + std::uint64_t{k} * t.element_slots)) return false;
    return true;
  }
  const rmp_code_type& x = c_.type(type);
  for (std::uint32_t k = 0; k < x.field_count; ++k) {
    const std::uint32_t f = c_.field(x.first_field + k).type;
    if (!deepen(p, f, address)) return false;
    address += c_.types[f].slots;
  }
  return true;
}

bool Run::equal(std::uint32_t type, const Slot* a, const Slot* b) const {
  const TypeInfo& t = c_.types[type];
  switch (t.kind) {
    case RMP_TYPE_REAL: return a->real() == b->real();
    case RMP_TYPE_STRING: return text_of(*a) == text_of(*b);
    case RMP_TYPE_LIST: {
      const Heap::List *x = list_of(*a), *y = list_of(*b);
      const std::size_t m = x ? x->slots.size() : 0, n = y ? y->slots.size() : 0;
      if (m != n) return false;
      for (std::size_t k = 0; k + t.element_slots <= m && t.element_slots; k += t.element_slots)
        if (!equal(t.element, x->slots.data() + k, y->slots.data() + k)) return false;
      return true;
    }
    case RMP_TYPE_ARRAY:
      for (std::size_t k = 0; k < t.length; ++k)
        if (!equal(t.element, a + k * t.element_slots, b + k * t.element_slots)) return false;
      return true;
    case RMP_TYPE_RECORD: {
      const rmp_code_type& x = c_.type(type);
      for (std::uint32_t k = 0; k < x.field_count; ++k) {
        const std::uint32_t f = c_.field(x.first_field + k).type;
        if (!equal(f, a, b)) return false;
        a += c_.types[f].slots;
        b += c_.types[f].slots;
      }
      return true;
    }
    default: return a->integer() == b->integer();
  }
}

void Run::append_text(std::uint32_t type, const Slot* slots, std::string& out,
                      std::size_t most) const {
  if (out.size() > most) return;
  const TypeInfo& t = c_.types[type];
  const auto several = [&](char open, char close, std::size_t count, const auto& part) {
    out += open;
    for (std::size_t k = 0; k < count && out.size() <= most; ++k) {
      if (k) out += ", ";
      part(k);
    }
    out += close;
  };
  switch (t.kind) {
    case RMP_TYPE_REAL: out += real_literal(slots->real()); return;
    case RMP_TYPE_BOOL: out += slots->integer() ? "TRUE" : "FALSE"; return;
    case RMP_TYPE_CHAR: out += static_cast<char>(slots->integer()); return;
    case RMP_TYPE_STRING: out += text_of(*slots); return;
    case RMP_TYPE_INT:
    case RMP_TYPE_SEMAPHORE: out += std::to_string(slots->integer()); return;
    case RMP_TYPE_PROCESS:
      out +=
          slots->integer() >= 0 && static_cast<std::uint32_t>(slots->integer()) < c_.routines.size()
              ? c_.routine_name(static_cast<std::uint32_t>(slots->integer()))
              : std::string();
      return;
    case RMP_TYPE_TEXT:
    case RMP_TYPE_FILE: {
      const auto i = static_cast<std::uint32_t>(slots->bits);
      if ((slots->bits & kTagMask) == kFileTag && i < s_.heap.files.size() && s_.heap.files[i].mode)
        out += s_.heap.files[i].name;
      else out += "closed";
      return;
    }
    case RMP_TYPE_ARRAY:
      return several('[', ']', t.length, [&](std::size_t k) {
        append_text(t.element, slots + k * t.element_slots, out, most);
      });
    case RMP_TYPE_LIST: {
      const Heap::List* l = list_of(*slots);
      return several('[', ']', l && t.element_slots ? l->slots.size() / t.element_slots : 0,
                     [&](std::size_t k) {
                       append_text(t.element, l->slots.data() + k * t.element_slots, out, most);
                     });
    }
    case RMP_TYPE_RECORD: {
      const rmp_code_type& x = c_.type(type);
      return several('(', ')', x.field_count, [&](std::size_t k) {
        const std::uint32_t f = c_.field(x.first_field + static_cast<std::uint32_t>(k)).type;
        append_text(f, slots, out, most);
        slots += c_.types[f].slots;
      });
    }
    default: return;
  }
}

std::uint64_t Run::bytes() const {
  // Only what the running process needs has changed since it was counted.
  const std::uint64_t own = p_ ? p_->bytes() - p_->counted : 0;
  return s_.globals.size() * sizeof(Slot) + s_.heap.bytes + s_.process_bytes + own;
}

/// Marks what slots lead to; a slot that looks like a handle is one (state.h).
void Run::collect() {
  Heap& h = s_.heap;
  for (auto& t : h.texts) t.is_marked = false;
  for (auto& l : h.lists) l.is_marked = false;
  std::vector<std::uint32_t> work;
  const auto mark = [&](const std::vector<Slot>& slots) {
    for (const Slot s : slots) {
      const auto i = static_cast<std::uint32_t>(s.bits);
      if ((s.bits & kTagMask) == kTextTag && !(s.bits & kConstantText)) {
        if (i < h.texts.size()) h.texts[i].is_marked = true;
      } else if ((s.bits & kTagMask) == kListTag && i < h.lists.size() && h.lists[i].is_used &&
                 !h.lists[i].is_marked) {
        h.lists[i].is_marked = true;
        work.push_back(i);
      }
    }
  };
  mark(s_.globals);
  for (const Process& p : s_.processes) mark(p.stack);
  while (!work.empty()) {
    const std::uint32_t i = work.back();
    work.pop_back();
    mark(h.lists[i].slots);
  }
  // An address may lead into a list that no handle leads to (a place within a value that a
  // function gave): those are kept as well.
  const auto keep_addressed = [&](const std::vector<Slot>& slots) {
    for (const Slot s : slots) {
      if ((s.bits & (std::uint64_t{7} << 61)) != kListAddress) continue;
      const std::uint64_t i = (s.bits & ~kListAddress) >> 32;
      if (i < h.lists.size() && h.lists[i].is_used && !h.lists[i].is_marked) {
        h.lists[i].is_marked = true;
        work.push_back(static_cast<std::uint32_t>(i));
      }
    }
  };
  for (const Process& p : s_.processes) keep_addressed(p.stack);
  while (!work.empty()) {
    const std::uint32_t i = work.back();
    work.pop_back();
    mark(h.lists[i].slots);
  }
  h.bytes = 0;
  for (std::uint32_t i = 0; i < h.texts.size(); ++i) {
    if (!h.texts[i].text) continue;
    if (h.texts[i].is_marked) {
      h.bytes += h.texts[i].text->size() + 48;
    } else {
      h.texts[i].text.reset();
      h.free_texts.push_back(i);
    }
  }
  for (std::uint32_t i = 0; i < h.lists.size(); ++i) {
    if (!h.lists[i].is_used) continue;
    if (h.lists[i].is_marked) {
      h.bytes += h.lists[i].slots.size() * 8 + 64;
    } else {
      h.lists[i].is_used = false;
      h.lists[i].slots = {};
      h.free_lists.push_back(i);
    }
  }
  for (const auto& f : h.files) h.bytes += f.text.size() + f.name.size();
  h.collect_at = std::max<std::uint64_t>(1 << 20, h.bytes * 2);
}

}  // namespace robomosp::program
