// SPDX-License-Identifier: Apache-2.0
// Guards of importers and exporters: names of files, words that can be shown. Records that were
// read are checked as files of records are.
#include <algorithm>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <robomosp/sdk/io.h>

#include "kernel/interface_file.h"
#include "kernel/provider_guard.h"
#include "kernel/text.h"

namespace robomosp {
namespace {

constexpr std::size_t kMostFileNotes = 1000;
constexpr std::size_t kLongestExtension = 16;

/// Notes as they can be shown; of very many the first.
void hear_all(std::vector<std::string>& notes) {
  const std::size_t count = notes.size();
  notes.resize(std::min(count, kMostFileNotes));
  for (std::string& note : notes) note = heard(note);
  if (count > kMostFileNotes)
    notes.push_back(std::to_string(count - kMostFileNotes) + " more notes are left out.");
}

/// Whether a name is one of a place, not of something beside the others.
bool leads_out(std::string_view name) {
  const auto parts = text::split(name, '/');
  return name.empty() || name.front() == '/' ||
         std::find(parts.begin(), parts.end(), "..") != parts.end();
}

/// The extensions that are any, comma-separated.
std::string sound_extensions(std::string_view all) {
  std::string out;
  if (all.size() > 64 * kLongestExtension) return out;
  for (const std::string_view part : text::split(all, ',')) {
    const std::string_view e = text::trim(part);
    if (e.size() <= kLongestExtension && is_file_name(e, false)) {
      out += out.empty() ? "" : ",";
      out += e;
    }
  }
  return out;
}

/// Asks once, when the provider is made: what is thrown then says that it could not be made.
class GuardedImporter final : public Importer {
 public:
  GuardedImporter(const ProviderInfo& info, Importer* inner)
      : name_(info.name), inner_(inner), extensions_(sound_extensions(inner->extensions())) {}
  [[nodiscard]] const void* extension(const char* id) const override {
    return inner_->extension(id);
  }
  [[nodiscard]] std::string_view extensions() const override { return extensions_; }
  Result<Imported> read(std::string_view path, const Params& params,
                        Progress& told) const override {
    HeardProgress progress(told);
    RMP_TRY_ASSIGN(Imported made,
                   asked(name_, [&] { return inner_->read(path, params, progress); }));
    for (const ImportedFile& f : made.records)
      if (leads_out(f.name))
        return broken_answer(name_, "named a record " + heard(text::quote(f.name)));
    for (const ImportedGeometry& g : made.geometries)
      if (g.geometry.form != CsgGeometry::Form::brep && g.geometry.form != CsgGeometry::Form::mesh)
        return broken_answer(name_, "made a geometry that is neither a B-rep nor a mesh");
    for (const ForeignGeometry& f : made.foreign)
      if (!all_finite(f.scale) || std::count(f.scale.begin(), f.scale.end(), 0.0) > 0)
        return broken_answer(
            name_, "gave a scale of " + heard(text::quote(f.name)) + " that is not a number, or 0");
    for (const CsgLoop& loop : made.profile.loops) {
      bool is_sound = all_finite(loop.start) && !loop.curves.empty();
      for (const CsgCurve& c : loop.curves) {
        is_sound = is_sound && !c.points.empty() && c.kind >= CsgCurve::Kind::line &&
                   c.kind <= CsgCurve::Kind::circle;
        for (const auto& p : c.points) is_sound = is_sound && all_finite(p);
      }
      if (!is_sound) return broken_answer(name_, "made an invalid profile");
    }
    hear_all(made.notes);
    return made;
  }

 private:
  std::string name_;
  std::unique_ptr<Importer> inner_;
  std::string extensions_;
};

class GuardedExporter final : public Exporter {
 public:
  GuardedExporter(const ProviderInfo& info, Exporter* inner)
      : name_(info.name), inner_(inner), extensions_(sound_extensions(inner->extensions())) {}
  [[nodiscard]] const void* extension(const char* id) const override {
    return inner_->extension(id);
  }
  [[nodiscard]] std::string_view extensions() const override { return extensions_; }
  [[nodiscard]] bool is_exact(std::string_view extension) const override {
    const auto exact = asked(name_, [&]() -> Result<bool> { return inner_->is_exact(extension); });
    if (exact.ok()) return *exact;
    const std::lock_guard lock(mutex_);
    fault_ = exact.error();
    return false;
  }
  Result<std::vector<ExportedFile>> write(const ExportTask& task, const Params& params,
                                          Progress& told) const override {
    {
      // What is_exact() could not say is said here.
      const std::lock_guard lock(mutex_);
      if (fault_) return *std::exchange(fault_, std::nullopt);
    }
    HeardProgress progress(told);
    RMP_TRY_ASSIGN(auto files, asked(name_, [&] { return inner_->write(task, params, progress); }));
    std::set<std::string> names;
    for (const ExportedFile& f : files) {
      if (f.name != task.name && !is_file_name(f.name, true))
        return broken_answer(name_, "made a file " + heard(text::quote(f.name)) +
                                        " that is not beside the main one");
      if (!names.insert(f.name).second)
        return broken_answer(name_, "made two files " + text::quote(f.name));
    }
    if (!names.contains(std::string(task.name)))
      return broken_answer(name_, "made no file " + text::quote(task.name));
    if (task.report) {
      hear_all(task.report->notes);
      for (ExportReport::Count& c : task.report->counts) {
        c.what = heard(c.what);
        if (c.count < 0 || c.what.empty())
          return broken_answer(name_, "counted fewer than no " + c.what);
      }
    }
    return files;
  }

 private:
  std::string name_;
  std::unique_ptr<Exporter> inner_;
  std::string extensions_;
  mutable std::mutex mutex_;
  mutable std::optional<Error> fault_;  // guarded by mutex_
};

}  // namespace

RMP_INTERFACES(files, guarded_interface<Importer, GuardedImporter>(),
               guarded_interface<Exporter, GuardedExporter>());

}  // namespace robomosp
