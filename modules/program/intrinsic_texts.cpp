// SPDX-License-Identifier: Apache-2.0
// Strings and lists of the language.
#include <algorithm>
#include <string>
#include <vector>

#include "program/intrinsics.h"

namespace robomosp::program {

Run::Did Run::Intrinsic::texts() {
  switch (c.fn) {
    case Fn::compare: {
      const int x = run.text_of(*in[0]).compare(run.text_of(*in[1]));
      return whole(x < 0 ? -1 : x > 0 ? 1 : 0);
    }
    case Fn::length: return whole(static_cast<std::int64_t>(run.text_of(*in[0]).size()));
    case Fn::locate: {
      const std::string_view s = run.text_of(*in[0]);
      run.cost_ += s.size() / 16;
      const std::size_t at_byte = s.find(run.text_of(*in[1]));
      return whole(at_byte == std::string_view::npos ? 0 : static_cast<std::int64_t>(at_byte) + 1);
    }
    case Fn::concat: {
      const std::size_t n = run.text_of(*in[0]).size() + run.text_of(*in[1]).size();
      run.cost_ += n / 64;
      if (n > 0x7fff'ffff) return failed("the string has more than 2147483647 characters");
      if (!run.has_room(n + 64)) return Did::failed;
      std::string s(run.text_of(*in[0]));
      s += run.text_of(*in[1]);
      const Slot made = run.new_text(std::move(s));
      *out() = made;
      return Did::done;
    }
    case Fn::extract:
    case Fn::delete_: {
      const std::string_view s = run.text_of(*in[0]);
      const std::int64_t from = in[1]->integer(), n = in[2]->integer();
      const auto size = static_cast<std::int64_t>(s.size());
      if (from < 1 || n < 0 || from - 1 + n > size)
        return failed(name() + " is of " + std::to_string(n) + " characters from " +
                          std::to_string(from) + " on, and the string has " + std::to_string(size),
                      "1 is the first.");
      run.cost_ += s.size() / 64;
      std::string made;
      if (c.fn == Fn::extract) {
        made = s.substr(static_cast<std::size_t>(from - 1), static_cast<std::size_t>(n));
      } else {
        made = s;
        made.erase(static_cast<std::size_t>(from - 1), static_cast<std::size_t>(n));
      }
      if (!run.has_room(made.size() + 64)) return Did::failed;
      const Slot t = run.new_text(std::move(made));
      if (c.fn == Fn::extract) {
        *out() = t;
      } else if (Slot* to = run.slots(p, c.arguments[0])) {
        *to = t;
      }
      return Did::done;
    }
    default: return unknown();
  }
}

Run::Did Run::Intrinsic::lists() {
  switch (c.fn) {
    case Fn::list_add:
    case Fn::list_insert:
    case Fn::list_delete:
    case Fn::list_clear:
    case Fn::list_index: {
      const TypeInfo& t = run.c_.types[c.arguments[0].type];
      const std::size_t each = t.element_slots;
      const Heap::List* known = run.list_of(*in[0]);
      const std::int64_t n =
          known && each ? static_cast<std::int64_t>(known->slots.size() / each) : 0;
      if (c.fn == Fn::list_index) {
        std::int64_t found = 0;
        for (std::int64_t k = 0; k < n && !found; ++k)
          if (run.equal(t.element, known->slots.data() + static_cast<std::size_t>(k) * each, in[1]))
            found = k + 1;
        run.cost_ += static_cast<std::uint64_t>(found ? found : n) * each / 4;
        return whole(found);
      }
      if (c.fn == Fn::list_clear) {
        if (Heap::List* l = run.list_of(*in[0])) {
          run.s_.heap.bytes -= std::min<std::uint64_t>(run.s_.heap.bytes, l->slots.size() * 8);
          l->slots = {};
        }
        return Did::done;
      }
      const std::int64_t place = c.fn == Fn::list_add ? n + 1 : in[1]->integer();
      const std::int64_t last = c.fn == Fn::list_insert ? n + 1 : n;
      if (c.fn != Fn::list_add && (place < 1 || place > last))
        return failed(
            "the place " + std::to_string(place) + " is outside 1.." + std::to_string(last),
            n == 0 ? "The list is empty." : "");
      const auto where = static_cast<std::ptrdiff_t>(place - 1) * static_cast<std::ptrdiff_t>(each);
      if (c.fn == Fn::list_delete) {
        Heap::List* l = run.list_of(*in[0]);
        l->slots.erase(l->slots.begin() + where,
                       l->slots.begin() + where + static_cast<std::ptrdiff_t>(each));
        run.s_.heap.bytes -= std::min<std::uint64_t>(run.s_.heap.bytes, each * 8);
        run.cost_ += (l->slots.size() - static_cast<std::size_t>(where)) / 16;
        return Did::done;
      }
      if (!run.has_room(each * 8 + 64)) return Did::failed;
      Slot* list_slot = run.slots(p, c.arguments[0]);
      if (!run.list_of(*list_slot)) {
        const Slot made = run.new_list();
        *run.slots(p, c.arguments[0]) = made;
        list_slot = run.slots(p, c.arguments[0]);
      }
      const Slot handle = *list_slot;
      Heap::List* l = run.list_of(handle);
      const std::vector<Slot> element(in[c.fn == Fn::list_add ? 1 : 2],
                                      in[c.fn == Fn::list_add ? 1 : 2] + each);
      run.cost_ += (l->slots.size() - static_cast<std::size_t>(where)) / 16;
      l->slots.insert(l->slots.begin() + where, element.begin(), element.end());
      run.s_.heap.bytes += each * 8;
      if (run.c_.types[t.element].has_list &&
          !run.deepen(
              p, t.element,
              kListAddress |
                  (static_cast<std::uint64_t>(static_cast<std::uint32_t>(handle.bits)) << 32) |
                  static_cast<std::uint64_t>(where)))
        return Did::failed;
      return Did::done;
    }
    default: return unknown();
  }
}

}  // namespace robomosp::program
