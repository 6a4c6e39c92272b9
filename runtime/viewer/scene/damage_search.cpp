#include "viewer/scene/damage_search.h"

#include "pbm_format/container/file_rules.h"
#include "pbm_format/hashes/hash.h"
#include "pbm_format/law/catalogue.h"
#include "pbm_format/reading/reader.h"
#include "system/files/mapped_file.h"

namespace pbm {
namespace {

// Verifies the chunks of a level one by one: an error names the chunk.
void search_chunks(Reader &reader, int level, const std::stop_token &stop, std::vector<Error> &found) {
    const auto directory = reader.directory(level);
    if (!directory)
        return; // its own section is damaged too
    const std::vector<ChunkEntry> &chunks = (*directory)->chunks;
    for (std::size_t i = 0; i < chunks.size() && found.size() < kMaxDamageFound && !stop.stop_requested(); ++i) {
        const auto bytes = reader.chunk_bytes(level, i);
        if (bytes && hash64(bytes->streams.bytes) != chunks[i].hash)
            found.push_back(broken("5.6.4", chunks[i].offset, "the chunk was changed: its hash does not match"));
    }
}

} // namespace

std::vector<Error> find_damage(ByteView file, const std::stop_token &stop) {
    auto reader = Reader::open(ByteSource(file, MappedFile::will_need));
    if (!reader)
        return {reader.error()};
    std::vector<Error> found;
    for (const SectionEntry &section : reader->sections()) {
        if (found.size() >= kMaxDamageFound || stop.stop_requested())
            break;
        if (section.type == SectionType::level_chunks) {
            search_chunks(*reader, static_cast<int>(section.instance), stop, found);
            continue;
        }
        const auto bytes = reader->source().view(section.range());
        if (const Status whole = bytes ? verify_hash(bytes->bytes, section) : Status(); !whole)
            found.push_back(whole.error());
    }
    return found;
}

} // namespace pbm
