// Makes invalid files: edits a valid one and repairs every hash.
#pragma once

#include "invalid_files.h"
#include "unit/support/file_editor.h"

#include <functional>
#include <string>
#include <utility>

namespace pbm::test {

class Collection {
  public:
    explicit Collection(Bytes usual) : usual_(std::move(usual)) {}

    using Edit = std::function<void(FileEditor &)>;

    void add(const std::string &name, const Bytes &good, const Edit &edit) {
        FileEditor editor(good);
        edit(editor);
        editor.repair();
        files_.push_back({name + ".pbvg", editor.bytes()});
    }
    void add(const std::string &name, const Edit &edit) { add(name, usual_, edit); }
    // Damage that a hash must detect: repairs nothing.
    void add_unrepaired(const std::string &name, std::size_t at) {
        Bytes file = usual_;
        file[at] ^= 0x10;
        files_.push_back({name + ".pbvg", std::move(file)});
    }
    void add_as_is(const std::string &name, Bytes bytes) { files_.push_back({name + ".pbvg", std::move(bytes)}); }
    std::vector<InvalidFile> take() { return std::move(files_); }

  private:
    Bytes usual_; // the default file to damage
    std::vector<InvalidFile> files_;
};

template <class T> Collection::Edit set(std::size_t at, T value) {
    return [=](FileEditor &file) { file.set<T>(at, value); };
}

// Sets a field of a section's table entry.
template <class T> Collection::Edit set_entry(SectionType type, std::uint32_t instance, std::size_t field, T value) {
    return [=](FileEditor &file) { file.set<T>(file.entry(type, instance) + field, value); };
}

// Sets a field inside a section.
template <class T> Collection::Edit set_in(SectionType type, std::size_t field, T value) {
    return [=](FileEditor &file) { file.set<T>(file.section(type) + field, value); };
}

// Sets a field of a chunk's directory entry.
template <class T> Collection::Edit set_chunk(std::uint32_t level, std::size_t index, std::size_t field, T value) {
    return [=](FileEditor &file) { file.set<T>(file.chunk(level, index) + field, value); };
}

// Removes the last bytes of a small section. `record`: the new element size.
inline Collection::Edit shorten(SectionType type, std::uint32_t record, std::uint64_t bytes) {
    return [=](FileEditor &file) { file.shorten(type, 0, bytes, record); };
}

// Files about ground plane and rasters: surroundings_files.cpp.
void add_surroundings_files(Collection &files);
std::vector<ValidFile> valid_surroundings_files();

// Files with fields: field_files.cpp.
void add_field_files(Collection &files);
std::vector<ValidFile> valid_field_files();

// Files whose points have sides: side_files.cpp.
void add_side_files(Collection &files);
std::vector<ValidFile> valid_side_files();

// Files of few points: small_files.cpp.
void add_small_files(Collection &files);
std::vector<ValidFile> valid_small_files();

} // namespace pbm::test
