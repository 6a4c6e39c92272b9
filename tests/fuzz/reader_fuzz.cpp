// Law: for any bytes, `verify` and `validate` give the same verdict. A valid file loads into a model that encodes,
// packed and mapped, to a file with the same content_id. Loading an invalid file returns an error or a model.
#include "pbm_format/checking/validate.h"
#include "pbm_format/reading/load_model.h"
#include "pbm_format/writing/writer.h"

#include <cstdlib>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    const pbm::ByteView file(data, size);
    const bool valid = pbm::verify(file, {.threads = 1}).ok();
    if (valid != pbm::validate(file, {.threads = 1}).valid())
        std::abort();
    pbm::Result<pbm::Reader> reader = pbm::Reader::open(file);
    const pbm::Result<pbm::Model> loaded = reader ? pbm::load_model(*reader, {.threads = 1}) : reader.error();
    if (valid && !loaded)
        std::abort();
    if (!valid)
        return 0;
    const pbm::Model &model = *loaded;
    for (const pbm::Storage storage : {pbm::Storage::packed, pbm::Storage::mapped}) {
        const pbm::Bytes again = pbm::encode_model(model, {.storage = storage,
                                                           .compression_level = 1,
                                                           .chunk_points = reader->header().chunk_points,
                                                           .threads = 1})
                                     .value();
        if (pbm::Reader::open(again)->header().content_id != reader->header().content_id)
            std::abort();
    }
    return 0;
}
