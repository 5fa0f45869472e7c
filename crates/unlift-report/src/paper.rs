//! Published figures of the paper behind unlift, to draw beside the figures of an audit.
//!
//! Source: tables "geometric accuracy" of the paper and its supplement for 7-scenes, 12-scenes and
//! Cambridge Landmarks. The scenes differ from those of an audit, so only the trend can be compared.

/// The source of the dashed curves.
pub const ATTRIBUTION: &str = "Chelani et al., Obfuscation Based Privacy Preserving \
    Representations are Recoverable Using Neighborhood Information, 3DV 2025";

/// `published_3d.csv`: dataset, scheme, inlier ratio, threshold in meters, percent recovered.
const TABLE: &str = include_str!("../published_3d.csv");

/// The recovered share over the inlier ratio, as published for one dataset, scheme and threshold.
#[derive(Debug, Clone, PartialEq)]
pub struct PublishedCurve {
    /// `7-scenes`, `12-scenes` or `cambridge`; for images followed by the features if these are not SIFT.
    pub dataset: &'static str,
    /// The scheme's user-facing name.
    pub scheme: &'static str,
    /// Largest error of a recovered point, in meters for maps and in pixels for images.
    pub threshold: f64,
    /// (inlier ratio, percent of the points recovered), by descending ratio.
    pub points: Vec<(f64, f64)>,
}

/// `published_2d.csv`: the columns of [`TABLE`] for keypoints of images, threshold in pixels.
const TABLE_2D: &str = include_str!("../published_2d.csv");

/// Returns all published curves of maps, in the order of the table.
pub fn published_3d() -> Vec<PublishedCurve> {
    curves(TABLE)
}

/// Returns all published curves of images, in the order of the table.
pub fn published_2d() -> Vec<PublishedCurve> {
    curves(TABLE_2D)
}

/// `published_pictures.csv`: dataset, dimensions, features, scheme (`none` for true points), inlier ratio, SSIM, PSNR in
/// dB and LPIPS. Source: tables "SSIM 2D", "SSIM 3D" and the supplement's tables of perceptual similarity. If two disagree
/// (the baseline of Cambridge in 3D), the value is from the paper itself.
pub(crate) const PICTURES: &str = include_str!("../published_pictures.csv");

/// The published similarity of pictures to photos on one dataset, with SIFT.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PublishedPictures {
    /// `7-scenes`, `12-scenes` or `cambridge`.
    pub dataset: &'static str,
    /// Structural similarity.
    pub ssim: f64,
}

/// Returns the published similarity of pictures for `scheme` in `dim` dimensions, at most one per dataset. The scheme `none`
/// means the true points and has no ratio.
pub fn published_pictures(
    dim: usize,
    scheme: &str,
    inlier_ratio: Option<f64>,
) -> Vec<PublishedPictures> {
    let of = |line: &'static str| {
        let cells: Vec<&'static str> = line.split(',').collect();
        let [dataset, dimensions, "sift", name, ratio, ssim, _, _] = cells[..] else { return None };
        let same = dimensions.parse() == Ok(dim) && name == scheme;
        (same && ratio.parse().ok() == inlier_ratio).then_some(())?;
        Some(PublishedPictures { dataset, ssim: ssim.parse().ok()? })
    };
    PICTURES.lines().skip(1).filter_map(of).collect()
}

fn curves(table: &'static str) -> Vec<PublishedCurve> {
    let mut curves: Vec<PublishedCurve> = Vec::new();
    for line in table.lines().skip(1) {
        let cells: Vec<&'static str> = line.split(',').collect();
        let [dataset, scheme, ratio, threshold, percent] = cells[..] else {
            unreachable!("published table: expected 5 cells in {line:?}");
        };
        let number = |cell: &str| cell.parse::<f64>().expect("published tables hold numbers");
        let threshold = number(threshold);
        let point = (number(ratio), number(percent));
        let same = |c: &PublishedCurve| {
            c.dataset == dataset && c.scheme == scheme && c.threshold == threshold
        };
        match curves.iter_mut().find(|curve| same(curve)) {
            Some(curve) => curve.points.push(point),
            None => curves.push(PublishedCurve { dataset, scheme, threshold, points: vec![point] }),
        }
    }
    curves
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_curve_has_the_six_ratios() {
        let curves = published_3d();
        assert_eq!(curves.len(), 3 * 6 * 2);
        let images = published_2d();
        assert_eq!(images.len(), 4 * 2 * 3);
        for curve in curves.iter().chain(&images) {
            let ratios: Vec<f64> = curve.points.iter().map(|point| point.0).collect();
            assert_eq!(ratios, [1.0, 0.75, 0.5, 0.3, 0.2, 0.1], "{curve:?}");
        }
    }

    #[test]
    fn pictures_are_as_printed() {
        let of = |dim, scheme, ratio| {
            let found = published_pictures(dim, scheme, ratio).into_iter();
            found.map(|found| (found.dataset, found.ssim)).collect::<Vec<_>>()
        };
        assert_eq!(of(2, "lines2d", Some(0.5))[0], ("7-scenes", 0.62));
        let baseline = [("7-scenes", 0.58), ("cambridge", 0.39), ("12-scenes", 0.58)];
        assert_eq!(of(3, "none", None), baseline);
        assert_eq!(of(3, "ppl", Some(0.5))[0], ("7-scenes", 0.56));
        assert_eq!(of(3, "ppl+", Some(0.5)), []);
        assert_eq!(PICTURES.lines().count(), 134);
    }

    #[test]
    fn a_cell_is_as_printed() {
        let curves = published_3d();
        let cp = curves
            .iter()
            .find(|c| c.dataset == "7-scenes" && c.scheme == "cp" && c.threshold == 0.10)
            .unwrap();
        assert_eq!(cp.points[2], (0.5, 67.7));
        let curves = published_2d();
        let lines = curves
            .iter()
            .find(|c| c.dataset == "7-scenes" && c.scheme == "lines2d" && c.threshold == 10.0)
            .unwrap();
        assert_eq!(lines.points[2], (0.5, 78.8));
    }
}
