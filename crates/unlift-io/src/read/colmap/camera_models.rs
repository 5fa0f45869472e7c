//! The camera models of COLMAP.

/// A camera model as files store it. Audits of points do not need its projection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CameraModel {
    /// The id in binary files and databases.
    pub id: i32,
    /// The name in text files.
    pub name: &'static str,
    /// The number of parameters.
    pub n_params: usize,
}

const fn model(id: i32, name: &'static str, n_params: usize) -> CameraModel {
    CameraModel { id, name, n_params }
}

/// All models of COLMAP 4.2. Row `i` has id `i`.
pub const CAMERA_MODELS: [CameraModel; 18] = [
    model(0, "SIMPLE_PINHOLE", 3),
    model(1, "PINHOLE", 4),
    model(2, "SIMPLE_RADIAL", 4),
    model(3, "RADIAL", 5),
    model(4, "OPENCV", 8),
    model(5, "OPENCV_FISHEYE", 8),
    model(6, "FULL_OPENCV", 12),
    model(7, "FOV", 5),
    model(8, "SIMPLE_RADIAL_FISHEYE", 4),
    model(9, "RADIAL_FISHEYE", 5),
    model(10, "THIN_PRISM_FISHEYE", 12),
    model(11, "RAD_TAN_THIN_PRISM_FISHEYE", 16),
    model(12, "SIMPLE_DIVISION", 4),
    model(13, "DIVISION", 5),
    model(14, "SIMPLE_FISHEYE", 3),
    model(15, "FISHEYE", 4),
    model(16, "EUCM", 6),
    model(17, "EQUIRECTANGULAR", 2),
];

impl CameraModel {
    /// Returns the model with this id.
    pub fn from_id(id: i32) -> Option<&'static Self> {
        CAMERA_MODELS.get(usize::try_from(id).ok()?)
    }

    /// Returns true if the first parameter is the focal length in both directions.
    pub fn has_one_focal(&self) -> bool {
        self.name.starts_with("SIMPLE_") || self.name.starts_with("RADIAL")
    }

    /// Returns the model with this name.
    pub fn from_name(name: &[u8]) -> Option<&'static Self> {
        CAMERA_MODELS.iter().find(|m| m.name.as_bytes() == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn row_is_id() {
        for (row, model) in CAMERA_MODELS.iter().enumerate() {
            assert_eq!(CameraModel::from_id(row as i32), Some(model));
            assert_eq!(CameraModel::from_name(model.name.as_bytes()).unwrap().id, row as i32);
        }
        assert_eq!(CameraModel::from_id(-1), None);
    }
}
