#include "viewer/scene/field_choice.h"

#include "pbm_format/reading/field_reader.h"

#include <algorithm>

namespace pbm {
namespace {

Error no_such_field(const std::vector<Field> &fields, const std::string &wanted) {
    std::string names;
    for (const Field &field : fields)
        names += (names.empty() ? "" : ", ") + field.name;
    return {ErrorCode::usage, 0,
            fields.empty() ? "the model has no fields; build it with pbm-build --field " + wanted
                           : "the model has no field '" + wanted + "' but " + names};
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
    return std::any_of(parameters.fields.begin(), parameters.fields.end(),
                       [&](const Field &field) { return field.name == name; });
}

Result<FieldColours> choose_field_colours(Reader &reader, const ColourBy &wanted) {
    const std::vector<Field> &fields = reader.parameters().fields;
    const auto found =
        std::find_if(fields.begin(), fields.end(), [&](const Field &field) { return field.name == wanted.field; });
    if (found == fields.end())
        return no_such_field(fields, wanted.field);
    const auto number = static_cast<std::size_t>(found - fields.begin());
    const Result<Bytes> sample = sample_of(reader, number);
    if (!sample)
        return sample.error();
    return field_colours(number, *found, wanted.choice, *sample);
}

} // namespace pbm
