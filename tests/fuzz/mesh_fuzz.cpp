#include "fuzz/surface_law.h"
#include "pbm_scan/mesh/material_text.h"
#include "pbm_scan/mesh/mesh_reader.h"

// Whatever a material file says, its numbers are those that a model can hold.
static void hold_materials(std::string_view text) {
    using namespace pbm::build;
    std::vector<NamedMaterial> materials;
    std::vector<AttributeReport> report;
    read_materials(text, {}, materials, report);
    finish_colours(materials, report);
    for (NamedMaterial &named : materials) {
        finish_reflectance(named);
        for (const float coefficient : {named.material.ks, named.material.environment, named.opacity})
            pbm::test::require(coefficient >= 0 && coefficient <= 1);
        pbm::test::require(named.material.power >= 1 && named.material.power <= 1024);
        if (named.reflectance)
            for (const double share :
                 {named.reflectance->roughness, named.reflectance->metal, named.reflectance->specular})
                pbm::test::require(share >= 0 && share <= 1);
    }
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    using namespace pbm::build;
    if (size == 0)
        return 0;
    pbm::test::hold_surface(read_obj({{data, size}}, {}), size);
    pbm::test::hold_surface(read_off({data, size}, {}), size);
    pbm::test::hold_surface(read_stl({data, size}, {}), size);
    hold_materials({reinterpret_cast<const char *>(data), size});
    return 0;
}
