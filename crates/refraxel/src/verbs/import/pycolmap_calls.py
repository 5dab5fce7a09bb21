"""The verbs of COLMAP that `refraxel import` calls, by pycolmap, with the options that it gives them."""

import sys

import pycolmap


def section(names, prefix, option):
    """The options that pycolmap has under the first of these names, with the number of threads."""
    keyword, kind = next((keyword, kind) for keyword, kind in names if hasattr(pycolmap, kind))
    options = getattr(pycolmap, kind)()
    if f"--{prefix}.num_threads" in option:
        options.num_threads = int(option[f"--{prefix}.num_threads"])
    return {keyword: options}


def feature_extractor(option):
    reader = pycolmap.ImageReaderOptions()
    reader.camera_model = option["--ImageReader.camera_model"]
    if "--ImageReader.mask_path" in option:
        reader.mask_path = option["--ImageReader.mask_path"]
    is_single = option.get("--ImageReader.single_camera") == "1"
    mode = pycolmap.CameraMode.SINGLE if is_single else pycolmap.CameraMode.PER_FOLDER
    kinds = [("extraction_options", "FeatureExtractionOptions"), ("sift_options", "SiftExtractionOptions")]
    pycolmap.extract_features(
        option["--database_path"],
        option["--image_path"],
        camera_mode=mode,
        reader_options=reader,
        device=pycolmap.Device.cpu,
        **section(kinds, "FeatureExtraction", option),
    )


def matcher(match, option):
    kinds = [("matching_options", "FeatureMatchingOptions"), ("sift_options", "SiftMatchingOptions")]
    more = section(kinds, "FeatureMatching", option)
    match(option["--database_path"], device=pycolmap.Device.cpu, **more)


def mapper(option):
    more = section([("options", "IncrementalPipelineOptions")], "Mapper", option)
    paths = (option["--database_path"], option["--image_path"], option["--output_path"])
    pycolmap.incremental_mapping(*paths, **more)


def bundle_adjuster(option):
    model = pycolmap.Reconstruction(option["--input_path"])
    options = pycolmap.BundleAdjustmentOptions()
    options.refine_principal_point = option.get("--BundleAdjustment.refine_principal_point") == "1"
    pycolmap.bundle_adjustment(model, options)
    model.write(option["--output_path"])


VERBS = {
    "feature_extractor": feature_extractor,
    "exhaustive_matcher": lambda option: matcher(pycolmap.match_exhaustive, option),
    # Its search for loops, which needs a vocabulary, is off unless it is asked for.
    "sequential_matcher": lambda option: matcher(pycolmap.match_sequential, option),
    "mapper": mapper,
    "bundle_adjuster": bundle_adjuster,
}

if __name__ == "__main__":
    verb, words = sys.argv[1], sys.argv[2:]
    VERBS[verb](dict(zip(words[::2], words[1::2])))
