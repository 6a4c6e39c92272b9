#include "pbm_render/appearance/field_choice.h"

#include "pbm_format/reading/field_reader.h"
#include "system/letters.h"

#include <algorithm>

namespace pbm {
namespace {

// The field of that name, else of that name in any case; null: none.
const Field *find_field(const std::vector<Field> &fields, const std::string &name) {
    const auto find = [&](const auto &fits) -> const Field * {
        const auto found = std::find_if(fields.begin(), fields.end(), fits);
        return found == fields.end() ? nullptr : &*found;
    };
    const Field *const exact = find([&](const Field &field) { return field.name == name; });
    return exact != nullptr ? exact : find([&](const Field &field) {
        return std::equal(field.name.begin(), field.name.end(), name.begin(), name.end(),
                          [](char a, char b) { return lower_case(a) == lower_case(b); });
    });
}

Error no_such_field(const std::vector<Field> &fields, const std::string &wanted) {
    std::string names;
    for (const Field &field : fields)
        names += (names.empty() ? "" : ", ") + field.name;
    return {ErrorCode::usage, 0,
            fields.empty() ? "the model has no fields; build it with pbm-build --field " + wanted
                           : "the model has no field '" + wanted + "' but " + names +
                                 (wanted.find(',') == std::string::npos
                                      ? ""
                                      : "; behind a comma stand a range or a map: viridis, grey, classes")};
}

// The finest level that is a single chunk.
int sample_level(const Reader &reader) {
    int level = 1;
    while (level < reader.depth() &&
           reader.section(SectionType::level_directory, static_cast<std::uint32_t>(level + 1))->count == 1)
        ++level;
    return level;
}

// Stored values of that level.
Result<Bytes> sample_of(Reader &reader, std::size_t field) {
    Result<FieldReader> fields = FieldReader::open(reader);
    if (!fields)
        return fields.error();
    Bytes values = fields->root_value(field);
    Chunk parent = reader.root_chunk();
    for (int level = 1; level <= sample_level(reader); ++level) {
        const Result<const LevelDirectory *> directory = reader.directory(level);
        if (!directory)
            return directory.error();
        if (Status read = fields->read_directory(**directory); !read)
            return read.error();
        Chunk chunk;
        if (Status loaded = reader.load_chunk(level, 0, parent, chunk); !loaded)
            return loaded.error();
        Bytes finer;
        if (Status loaded = fields->load(level, 0, field, chunk.masks, values, finer); !loaded)
            return loaded.error();
        values = std::move(finer);
        parent = std::move(chunk);
    }
    return values;
}

} // namespace

bool has_field(const ModelParameters &parameters, const std::string &name) {
    return find_field(parameters.fields, name) != nullptr;
}

std::vector<FileRange> field_sample_ranges(const Reader &reader) {
    std::vector<FileRange> ranges;
    const auto add = [&](SectionType type, int level) {
        if (const SectionEntry *section = reader.section(type, static_cast<std::uint32_t>(level)))
            ranges.push_back(section->range());
    };
    add(SectionType::fields, 0);
    for (int level = 1; !ranges.empty() && level <= sample_level(reader); ++level)
        for (const SectionType type :
             {SectionType::level_directory, SectionType::level_bricks, SectionType::level_chunks,
              SectionType::field_directory, SectionType::field_values})
            add(type, level);
    return ranges;
}

Result<FieldColours> choose_field_colours(Reader &reader, const std::string &name, const ColourChoice &choice) {
    const std::vector<Field> &fields = reader.parameters().fields;
    const Field *const found = find_field(fields, name);
    if (found == nullptr)
        return no_such_field(fields, name);
    const auto number = static_cast<std::size_t>(found - fields.data());
    const Result<Bytes> sample = sample_of(reader, number);
    if (!sample)
        return sample.error();
    return field_colours(number, *found, choice, *sample);
}

} // namespace pbm
