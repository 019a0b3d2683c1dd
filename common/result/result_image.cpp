#include "common/result/result_image.hpp"

#include "common/result/contents.hpp"
#include "common/result/hdf5_file.hpp"
#include "common/result/start_frame.hpp"

namespace tubule {

std::vector<std::byte> result_image(const Result& result) {
    Contents contents;
    contents.about_begun = result.about.size();
    contents.case_text = result.case_text, contents.case_text.resolved = resolved_case(result.case_text);
    contents.about = result.about, contents.series = result.series_names;
    const std::size_t width = contents.series.size(), rows = result.series.at("time").size();
    contents.rows.resize(width * rows);
    for (std::size_t j = 0; j < width; ++j) {
        const std::vector<double>& column = result.series.at(contents.series[j]);
        for (std::size_t i = 0; i < rows; ++i) contents.rows[i * width + j] = column[i];
    }
    contents.meshes = result.meshes, contents.frames = result.frames, contents.checkpoint = result.checkpoint;
    return hdf5_image(contents);
}

}  // namespace tubule
