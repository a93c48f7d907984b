#include "rover/diagnosis/dataset_survey.h"

#include <algorithm>

#include "rover/base/error.h"

namespace rover {
namespace {

void count_missing(const SensorFrame& frame, DatasetSurvey& survey) {
  for (std::size_t i = 0; i < survey.missing.size(); ++i) {
    if (i < frame.images.size() && !frame.images[i].empty()) continue;
    ++survey.missing[i];
    if (i < frame.problems.size() && !frame.problems[i].empty())
      survey.image_problems.push_back(frame.problems[i]);
  }
}

}  // namespace

DatasetSurvey survey_dataset(Dataset& dataset, int samples) {
  DatasetSurvey survey;
  survey.rig = dataset.rig();
  survey.imu_calibration = dataset.imu_calibration();
  survey.ground_truth = dataset.ground_truth();
  survey.notes = dataset.notes();
  survey.missing.resize(survey.rig.cameras.size());
  const std::size_t stride =
      std::max<std::size_t>(1, dataset.size() / static_cast<std::size_t>(samples));
  while (auto frame = dataset.next()) {
    const std::size_t index = survey.times.size();
    survey.times.push_back(frame->time);
    survey.imu.insert(survey.imu.end(), frame->imu.begin(), frame->imu.end());
    count_missing(*frame, survey);
    if (index % stride == stride / 2 && std::ssize(survey.samples) < samples && frame->usable())
      survey.samples.push_back({frame->time, std::move(frame->images)});
  }
  require(!survey.times.empty(), "the dataset holds no frame; check the folder");
  require(!survey.samples.empty(), "none of the frames looked at has a usable image{}{}",
          survey.image_problems.empty() ? "" : ": ",
          survey.image_problems.empty() ? "" : survey.image_problems.front());
  return survey;
}

}  // namespace rover
