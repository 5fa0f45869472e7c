use unlift::Error;

/// Options of SIFT. The defaults are COLMAP's.
#[derive(Clone, Debug, PartialEq)]
pub struct SiftOptions {
    /// Number of requested features, default 8192. Whole levels are kept, from the coarsest to the
    /// one that exceeds this number, so more may be returned.
    pub max_features: usize,
    /// Longest side in pixels, default 3200. Larger images are downsized; keypoints are in pixels
    /// of the original image.
    pub max_image_size: usize,
    /// Doubles the image first, which finds the finest features (COLMAP: first octave -1).
    pub doubled: bool,
    /// Maximum number of octaves, with the doubled one; default 4.
    pub octaves: usize,
    /// Levels of scale in an octave; default 3.
    pub levels: usize,
    /// Minimum contrast of a keypoint, as a difference of gray values in `0..1`; default 0.02 / 3.
    pub peak_threshold: f64,
    /// Maximum ratio of principal curvatures, default 10; keypoints above it are on edges.
    pub edge_threshold: f64,
    /// Maximum number of keypoints per position, each with its own orientation; default 2.
    pub max_orientations: usize,
    /// Sets all orientations to zero.
    pub upright: bool,
}

impl Default for SiftOptions {
    fn default() -> Self {
        Self {
            max_features: 8192,
            max_image_size: 3200,
            doubled: true,
            octaves: 4,
            levels: 3,
            peak_threshold: 0.02 / 3.0,
            edge_threshold: 10.0,
            max_orientations: 2,
            upright: false,
        }
    }
}

impl SiftOptions {
    /// Checks that every value is in its range.
    ///
    /// # Errors
    /// If a field is out of range; the error names the first one.
    pub fn check(&self) -> Result<(), Error> {
        let whole: [(&str, usize, usize, usize); 5] = [
            ("max_features", self.max_features, 1, usize::MAX),
            ("max_image_size", self.max_image_size, 1, 1 << 16),
            ("octaves", self.octaves, 1, 16),
            ("levels", self.levels, 1, 16),
            ("max_orientations", self.max_orientations, 1, super::orientation::MOST),
        ];
        for (name, value, least, most) in whole {
            if !(least..=most).contains(&value) {
                let expected = match most {
                    usize::MAX => format!("at least {least}"),
                    _ => format!("{least} to {most}"),
                };
                return Err(Error::new(name, expected, value.to_string()));
            }
        }
        let real =
            [("peak_threshold", self.peak_threshold), ("edge_threshold", self.edge_threshold)];
        for (name, value) in real {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::new(name, "a positive number", value.to_string()));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn check_names_the_field() {
        assert_eq!(SiftOptions::default().check(), Ok(()));
        let text = |options: SiftOptions| options.check().unwrap_err().to_string();
        let defaults = SiftOptions::default;
        assert_eq!(
            text(SiftOptions { max_features: 0, ..defaults() }),
            "max_features: expected at least 1, found 0"
        );
        assert_eq!(
            text(SiftOptions { max_orientations: 5, ..defaults() }),
            "max_orientations: expected 1 to 4, found 5"
        );
        assert_eq!(
            text(SiftOptions { edge_threshold: f64::NAN, ..defaults() }),
            "edge_threshold: expected a positive number, found NaN"
        );
    }
}
