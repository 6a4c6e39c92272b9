// Which attributes of a scan a build keeps as fields, and where a reader puts their values.
#pragma once

#include "pbm_scan/surface/surface.h"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace pbm::build {

// Whether the user's name of a field means an attribute of the file: in any case, with spaces and hyphens as "_", and
// without the "scalar_" that CloudCompare writes or an element's name ("vertex.").
bool is_same_field(std::string_view wanted, std::string_view in_file);

// Whether values of this name are labels, of which there is no mean: classes, numbers of returns and scans, ids.
bool is_label(std::string_view name);

// The classes of `list`, numbers or names of LAS classes with a comma between them: "noise,ground,31".
Result<std::bitset<256>> parse_classes(const std::string &list);

// The values of one attribute of the file, of the fields that mean it. Without any it does nothing.
class FieldColumn {
  public:
    // Takes the fields of `options` that mean `name` and that no attribute before has taken.
    FieldColumn(Surface &surface, const ReadOptions &options, std::string_view name, std::string_view unit = {});

    bool is_wanted() const { return !slots_.empty(); }
    // Whether the user asked for the field, not only for dropping classes.
    bool is_kept() const { return !slots_.empty() && slots_.front() < kMaxFields; }
    void resize(std::size_t points) const {
        for (const std::size_t slot : slots_)
            surface_->field_values[slot].resize(points);
    }
    void set(std::size_t point, double value) const {
        for (const std::size_t slot : slots_)
            surface_->field_values[slot][point].number = value;
    }
    void add(double value) const {
        for (const std::size_t slot : slots_)
            surface_->field_values[slot].push_back({value});
    }

  private:
    Surface *surface_;
    std::vector<std::size_t> slots_;
};

// The line of an attribute that could be a field: kept as one, or dropped with the option that keeps it.
AttributeReport field_report(const std::string &name, const FieldColumn &column, std::string_view reason);

} // namespace pbm::build
