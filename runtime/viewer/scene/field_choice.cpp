#include "viewer/scene/field_choice.h"

#include "pbm_format/reading/field_reader.h"
#include "system/files/file_names.h"

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
    return exact != nullptr ? exact
                            : find([&](const Field &field) { return lower_case(field.name) == lower_case(name); });
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

// Stored values of the finest level that is a single chunk.
Result<Bytes> sample_of(Reader &reader, std::size_t field) {
    Result<FieldReader> fields = FieldReader::open(reader);
    if (!fields)
        return fields.error();
    Bytes values = fields->root_value(field);
    Chunk parent = reader.root_chunk();
    for (int level = 1; level <= reader.depth(); ++level) {
        const Result<const LevelDirectory *> directory = reader.directory(level);
        if (!directory)
            return directory.error();
        if ((*directory)->chunks.size() > 1)
            break;
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

Result<FieldColours> choose_field_colours(Reader &reader, const ColourBy &wanted) {
    const std::vector<Field> &fields = reader.parameters().fields;
    const Field *const found = find_field(fields, wanted.field);
    if (found == nullptr)
        return no_such_field(fields, wanted.field);
    const auto number = static_cast<std::size_t>(found - fields.data());
    const Result<Bytes> sample = sample_of(reader, number);
    if (!sample)
        return sample.error();
    return field_colours(number, *found, wanted.choice, *sample);
}

} // namespace pbm
