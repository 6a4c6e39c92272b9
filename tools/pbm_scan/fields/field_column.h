// Which attributes of a scan a build keeps as fields, and where a reader puts their values.
#pragma once

#include "pbm_scan/surface/surface.h"

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace pbm::build {

// An attribute of a file that could be a field.
struct FieldOffer {
    std::string_view name;
    std::string_view unit{};
};

// How well the user's name of a field fits an attribute's name in the file; 0: not at all. The same name fits best.
// Next is a name that is equal but for case and for "_" in place of space, hyphen, comma and equals sign. Last is such
// a name without its prefix: CloudCompare's "scalar_", an element's name ("vertex."), or that of an E57 extension
// ("las:").
int likeness(std::string_view wanted, std::string_view in_file);

// Whether values of this name are labels, whose mean is meaningless: classes, numbers of returns and scans, ids.
bool is_label(std::string_view name);

// Writes the values of one attribute of the file to the fields that name it. Does nothing if no field does.
class FieldColumn {
  public:
    FieldColumn(Surface &surface, std::vector<std::size_t> slots) : surface_(&surface), slots_(std::move(slots)) {}

    bool is_wanted() const { return !slots_.empty(); }
    // Whether the user asked for the field, not only for dropping classes.
    bool is_kept() const { return !slots_.empty() && slots_.front() < kMaxFields; }
    // What becomes of a wanted attribute, for the report.
    const char *note() const { return is_kept() ? "a field" : "its classes, for --drop-class"; }
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

// The columns of all attributes of the file. Each field of `options` goes to the attribute whose name fits it best;
// each of `usual`, ReadOptions::usual_fields, likewise unless that attribute is a field already.
std::vector<FieldColumn> field_columns(Surface &surface, const ReadOptions &options, std::span<const FieldOffer> offers,
                                       std::span<const std::string> usual = {});
FieldColumn field_column(Surface &surface, const ReadOptions &options, std::string_view name); // the only one

inline constexpr std::string_view kSkippedColumn = "-"; // name of an attribute that is no field and is not reported

// Numbers the later ones of equal names: "label", "label_2".
void make_distinct(std::vector<std::string> &names);

// The line of an attribute that could be a field: kept as one, or dropped with the option that keeps it.
AttributeReport field_report(const std::string &name, const FieldColumn &column, std::string_view reason);

} // namespace pbm::build
