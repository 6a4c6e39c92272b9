#include "pbm_render/appearance/field_choice.h"

#include "pbm_format/model/octree.h"
#include "pbm_format/reading/field_reader.h"
#include "system/letters.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

namespace pbm {
namespace {

bool is_same(std::string_view a, std::string_view b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](char x, char y) { return lower_case(x) == lower_case(y); });
}

// The field of that name, else of that name in any case; null: none.
const Field *find_named(const std::vector<Field> &fields, std::string_view name) {
    const auto find = [&](const auto &fits) -> const Field * {
        const auto found = std::find_if(fields.begin(), fields.end(), fits);
        return found == fields.end() ? nullptr : &*found;
    };
    const Field *const exact = find([&](const Field &field) { return field.name == name; });
    return exact != nullptr ? exact : find([&](const Field &field) { return is_same(field.name, name); });
}

constexpr std::array<std::pair<std::string_view, ColourBasis>, 3> kComputed{
    {{"height", ColourBasis::height}, {"normal", ColourBasis::normal}, {"plain", ColourBasis::plain}}};

// What every model has; absent: `name` is that of a field.
std::optional<ColourBasis> computed_basis(const std::string &name) {
    const auto found =
        std::find_if(kComputed.begin(), kComputed.end(), [&](const auto &known) { return is_same(known.first, name); });
    return found == kComputed.end() ? std::nullopt : std::optional(found->second);
}

Error no_such_field(const std::vector<Field> &fields, const std::string &wanted) {
    std::string names;
    for (const Field &field : fields)
        names += (names.empty() ? "" : ", ") + field.name;
    return usage_error(fields.empty() ? "the model has no fields; build it with pbm-build --field " + wanted
                                      : "the model has no field '" + wanted + "' but " + names +
                                            (wanted.find(',') == std::string::npos
                                                 ? ""
                                                 : "; behind a comma stand a range or a map: viridis, grey, classes"));
}

// The finest level that is a single chunk.
int sample_level(const Reader &reader) {
    int level = 1;
    while (level < reader.depth() &&
           reader.section(SectionType::level_directory, static_cast<std::uint32_t>(level + 1))->count == 1)
        ++level;
    return level;
}

// Reads the levels up to `finest`, each of a single chunk. Calls `read(directory, chunk)` with each, which returns a
// Status.
template <class Read> Status read_coarse_levels(Reader &reader, int finest, const Read &read) {
    Chunk parent = reader.root_chunk();
    for (int level = 1; level <= finest; ++level) {
        const Result<const LevelDirectory *> directory = reader.directory(level);
        if (!directory)
            return directory.error();
        Chunk chunk;
        if (Status loaded = reader.load_chunk(level, 0, parent, chunk); !loaded)
            return loaded;
        if (Status done = read(**directory, chunk); !done)
            return done;
        parent = std::move(chunk);
    }
    return {};
}

// Stored values of a field in that level.
Result<Bytes> field_sample(Reader &reader, std::size_t field) {
    Result<FieldReader> fields = FieldReader::open(reader);
    if (!fields)
        return fields.error();
    Bytes values = fields->root_value(field);
    const auto read_level = [&](const LevelDirectory &directory, const Chunk &chunk) -> Status {
        if (Status known = fields->read_directory(directory); !known)
            return known;
        Bytes finer;
        if (Status loaded = fields->load(directory.level, 0, field, chunk.masks, values, finer); !loaded)
            return loaded;
        values = std::move(finer);
        return {};
    };
    const Status read = read_coarse_levels(reader, sample_level(reader), read_level);
    return read ? Result<Bytes>(std::move(values)) : read.error();
}

// Stored heights of its points.
Result<Bytes> height_sample(Reader &reader, std::size_t axis) {
    std::vector<MortonCode> codes{0};
    const auto read_level = [&](const LevelDirectory &directory, const Chunk &chunk) -> Status {
        auto children = expand_level(codes, chunk.masks, static_cast<std::size_t>(directory.points));
        if (!children)
            return children.error();
        codes = std::move(*children);
        return {};
    };
    const Status read = read_coarse_levels(reader, sample_level(reader), read_level);
    if (!read)
        return read.error();
    Bytes heights(2 * codes.size());
    for (std::size_t i = 0; i < codes.size(); ++i)
        set_stored_value(heights, i, 2, stored_height(morton_decode(codes[i])[axis], sample_level(reader)));
    return heights;
}

// Has a few hundred points; 0: nobody asks.
int one_colour_level(const Reader &reader) {
    const ModelParameters &parameters = reader.parameters();
    const bool may_be_softened = parameters.attributes.colour != ColourFormat::none && parameters.lights.empty();
    return may_be_softened ? std::min(3, sample_level(reader)) : 0;
}

// The ranges of the levels up to `finest`; `with_fields`: and those of their fields.
void add_levels(const Reader &reader, int finest, bool with_fields, std::vector<FileRange> &ranges) {
    for (int level = 1; level <= finest; ++level)
        for (const SectionType type :
             {SectionType::level_directory, SectionType::level_bricks, SectionType::level_chunks,
              SectionType::field_directory, SectionType::field_values})
            if (const SectionEntry *section = reader.section(type, static_cast<std::uint32_t>(level));
                section != nullptr && (with_fields || type < SectionType::field_directory))
                ranges.push_back(section->range());
}

} // namespace

const Field *find_field(const std::vector<Field> &fields, const std::string &name) {
    const Field *const named = find_named(fields, name);
    return named != nullptr ? named : find_named(fields, field_to_keep(name));
}

bool can_colour_by(const ModelParameters &parameters, const std::string &name) {
    return computed_basis(name) || find_field(parameters.fields, name) != nullptr;
}

std::vector<std::string> colour_names(const ModelParameters &parameters) {
    std::vector<std::string> names;
    for (const Field &field : parameters.fields)
        names.push_back(field.name);
    for (const auto &[name, basis] : kComputed)
        if (find_named(parameters.fields, name) == nullptr)
            names.emplace_back(name);
    return names;
}

std::string field_to_keep(const std::string &name) {
    if (computed_basis(name))
        return {};
    return is_same(name, "class") ? "classification" : is_same(name, "return") ? "return_number" : name;
}

std::vector<FileRange> colour_sample_ranges(const Reader &reader, const std::string &name) {
    const bool is_field = find_field(reader.parameters().fields, name) != nullptr;
    const std::optional<ColourBasis> basis = computed_basis(name);
    std::vector<FileRange> ranges;
    if (!is_field && (!basis || *basis == ColourBasis::normal || *basis == ColourBasis::plain))
        return ranges;
    if (is_field)
        ranges.push_back(reader.section(SectionType::fields)->range());
    add_levels(reader, sample_level(reader), is_field, ranges);
    return ranges;
}

std::vector<FileRange> one_colour_ranges(const Reader &reader) {
    std::vector<FileRange> ranges;
    add_levels(reader, one_colour_level(reader), false, ranges);
    return ranges;
}

Result<bool> has_one_colour(Reader &reader) {
    const int finest = one_colour_level(reader);
    const auto width =
        static_cast<std::ptrdiff_t>(bytes_per_point({.kind = StreamKind::colour}, reader.parameters().attributes));
    bool one = finest > 0;
    const auto read_level = [&](const LevelDirectory &, const Chunk &chunk) -> Status {
        const Bytes &colours = chunk.points.colours;
        one = one && std::equal(colours.begin() + width, colours.end(), colours.begin());
        return {};
    };
    const Status read = read_coarse_levels(reader, finest, read_level);
    return read ? Result<bool>(one) : read.error();
}

Result<FieldColours> choose_field_colours(Reader &reader, const std::string &name, const ColourChoice &choice,
                                          std::optional<UpAxis> up) {
    const ModelParameters &parameters = reader.parameters();
    const std::vector<Field> &fields = parameters.fields;
    const Field *const found = find_field(fields, name);
    const std::optional<ColourBasis> basis = computed_basis(name);
    if (found == nullptr && !basis)
        return no_such_field(fields, field_to_keep(name));
    if (found == nullptr && *basis != ColourBasis::height) {
        FieldColours colours;
        colours.basis = *basis;
        return colours;
    }
    constexpr std::array<std::size_t, 3> kAxes{1, 2, 0}; // [UpAxis]
    const auto number = static_cast<std::size_t>(found == nullptr ? 0 : found - fields.data());
    const std::size_t axis = kAxes[static_cast<std::size_t>(up.value_or(parameters.grid.up))];
    const Result<Bytes> sample = found == nullptr ? height_sample(reader, axis) : field_sample(reader, number);
    if (!sample)
        return sample.error();
    return found == nullptr ? height_colours(parameters.grid, axis, choice, *sample)
                            : field_colours(number, *found, choice, *sample);
}

} // namespace pbm
