// Reads the fields of a file beside its Reader: a program that shows no field reads none of their bytes. BVG.md 17
#pragma once

#include "pbm_format/container/field_sections.h"
#include "pbm_format/reading/reader.h"

namespace pbm {

class FieldReader {
  public:
    // For a file with fields, Reader::parameters().fields. `reader` must outlive the result. Of a source that is not
    // whole each function needs the bytes that it reads: the section of the fields, the directories of the fields of a
    // level (directory_range), the values of a field in a chunk (FieldEntry::range).
    static Result<FieldReader> open(const Reader &reader);

    const std::vector<Field> &fields() const { return table_.fields; }
    const Hash128 &id() const { return table_.id; } // fields_id
    // The field's stored value of the model as one point: the parent of the chunk of level 1.
    Bytes root_value(std::size_t field) const;

    // Verifies and returns the directory of the fields of a level, whose chunks are in `level`.
    Result<FieldDirectory> directory(const LevelDirectory &level) const;
    FileRange directory_range(int level) const {
        return reader_->section(SectionType::field_directory, static_cast<std::uint32_t>(level))->range();
    }
    // Reads it for `entry` and `load`, and drops its stored bytes. Not for several threads at once.
    Status read_directory(const LevelDirectory &level);
    // Of a level whose directory was read before.
    const FieldEntry &entry(int level, std::size_t chunk, std::size_t field) const {
        return directories_[static_cast<std::size_t>(level)].at(chunk, field);
    }

    // Decodes the stored values of a field in chunk `index` of `level`, whose directory was read before. `masks` and
    // `parents` as decode_field takes them. Safe to call from several threads.
    //
    // errors  as decode_field
    Status load(int level, std::size_t index, std::size_t field, ByteView masks, ByteView parents, Bytes &to) const;

  private:
    explicit FieldReader(const Reader &reader) : reader_(&reader) {}

    const Reader *reader_;
    FieldTable table_;
    std::vector<FieldDirectory> directories_; // [depth + 1]; empty where not read yet
};

// Loads all fields of a model whose masks are loaded.
Status load_fields(Reader &reader, int threads, Model &model);

} // namespace pbm
