//! A number of the paper beside ours, from the rows of the scenes' documents.

use indexmap::IndexMap;
use unlift_report::Document;
use unlift_report::document::Row;
use unlift_report::printed::{Measured, Points, Printed};

/// The audit of a scene, and the keys of its rows.
pub struct OfScene {
    /// The scene's name.
    pub scene: String,
    /// 2 for images, 3 for maps.
    pub dim: usize,
    /// `sift` or `superpoint`.
    pub features: &'static str,
    /// The paper's thresholds, with their labels in the document.
    pub thresholds: Vec<(f64, String)>,
    /// The figures.
    pub document: Document,
}

/// A number of the paper beside ours.
#[derive(Clone, Debug, PartialEq)]
pub struct Compared {
    /// The number of the paper.
    pub printed: Printed,
    /// Our numbers by scene, of the strongest attack.
    pub by_scene: IndexMap<String, f64>,
}

impl Compared {
    /// Compares `printed` with the results of `audits`.
    pub fn new(printed: Printed, audits: &[OfScene]) -> Self {
        let found = audits.iter().filter_map(|one| Some((one.scene.clone(), one.ours(&printed)?)));
        let by_scene = found.collect();
        Self { printed, by_scene }
    }

    /// Returns the mean over the scenes, as in the paper; `None` without a scene.
    pub fn ours(&self) -> Option<f64> {
        let n = self.by_scene.len();
        (n > 0).then(|| self.by_scene.values().sum::<f64>() / n as f64)
    }
}

impl OfScene {
    /// Returns the number of this scene: the largest share, or the most similar picture.
    fn ours(&self, number: &Printed) -> Option<f64> {
        if (self.dim, self.features) != (number.dim, number.features) {
            return None;
        }
        let rows = self.document.results.iter().filter(|row| is_about(row, number));
        let values = rows.filter_map(|row| self.value(row, number));
        match number.measured {
            Measured::Lpips => values.reduce(f64::min),
            Measured::Within(_) | Measured::Ssim | Measured::Psnr => values.reduce(f64::max),
        }
    }

    fn value(&self, row: &Row, number: &Printed) -> Option<f64> {
        let name = match number.measured {
            Measured::Within(threshold) => {
                let label = self.thresholds.iter().find(|(value, _)| *value == threshold);
                return row.recovered_percent.get(&label?.1).copied();
            }
            Measured::Ssim => "ssim",
            Measured::Psnr => "psnr",
            Measured::Lpips => "lpips",
        };
        let of = if number.points == Points::Originals { "_baseline" } else { "" };
        row.metrics.get(&format!("{name}{of}")).copied()
    }
}

fn is_about(row: &Row, number: &Printed) -> bool {
    let is_oracle = row.neighbors == "oracle";
    match number.points {
        // Every row contains the figures of the original points.
        Points::Originals => true,
        Points::Oracle(ratio) => {
            row.scheme == number.scheme && is_oracle && row.inlier_ratio == ratio
        }
        Points::Estimated => row.scheme == number.scheme && !is_oracle,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two solvers with the oracle at ratio 0.5, and one other source.
    fn audited(scene: &str, shares: [f64; 3]) -> OfScene {
        let rows = [("oracle", "joint"), ("oracle", "consensus"), ("overlap", "joint")];
        let rows: Vec<String> = rows
            .iter()
            .zip(shares)
            .map(|((by, solver), share)| {
                format!(
                    r#"{{"scheme": "cp", "neighbors": "{by}", "oracle_noise": null, "inlier_ratio": 0.5, "k": 20,
                    "solver": "{solver}", "delta": 1.0, "unit": "px", "n_points": 9, "n_lost": 0, "lost": {{}},
                    "dropped": {{}}, "recovered_percent": {{"9.375": {share}}}, "blind_percent": {{"9.375": 1.0}},
                    "axis_accuracy_percent": null, "assignment_accuracy_percent": null, "median_error": 1.0,
                    "error_percentiles": {{}}, "metrics": {{"lpips": {share}, "lpips_baseline": 0.25}}}}"#
                )
            })
            .collect();
        let text = format!(
            r#"{{"unlift": "0", "schema": 1, "options": {{}}, "seed": 0, "break_even": [],
            "input": {{"path": null, "n_points": 9, "scale_m_per_unit": null}}, "results": [{}],
            "run": {{"threads": 1, "peak_memory_bytes": null, "seconds": {{"total": 1.0, "rows": []}}}}}}"#,
            rows.join(",")
        );
        let document: Document = serde_json::from_str(&text).unwrap();
        let thresholds = vec![(5.0, "9.375".to_owned())];
        OfScene { scene: scene.to_owned(), dim: 2, features: "sift", thresholds, document }
    }

    fn number(points: Points, measured: Measured) -> Printed {
        let (scheme, features) = ("cp", "sift");
        Printed { table: 1, dim: 2, features, scheme, points, measured, value: 50.0 }
    }

    #[test]
    fn ours_is_the_mean_of_the_strongest() {
        let audits = [audited("a", [10.0, 30.0, 80.0]), audited("b", [20.0, 10.0, 60.0])];
        let ours = |points, measured| Compared::new(number(points, measured), &audits).ours();
        assert_eq!(ours(Points::Oracle(0.5), Measured::Within(5.0)), Some(25.0));
        assert_eq!(ours(Points::Estimated, Measured::Within(5.0)), Some(70.0));
        assert_eq!(ours(Points::Oracle(0.5), Measured::Lpips), Some(10.0));
        assert_eq!(ours(Points::Originals, Measured::Lpips), Some(0.25));
        // Numbers that were not measured are `None`.
        assert_eq!(ours(Points::Oracle(0.3), Measured::Within(5.0)), None);
        assert_eq!(ours(Points::Oracle(0.5), Measured::Within(10.0)), None);
        assert_eq!(ours(Points::Oracle(0.5), Measured::Ssim), None);
    }
}
