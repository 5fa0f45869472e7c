use std::io::Write;
use std::path::PathBuf;

use serde_json::{Value, json};
use unlift_io::atomic::{Access, Kind, OutputSet, write_file};
use unlift_report::paper::ATTRIBUTION;
use unlift_report::printed::{Measured, Points, Printed};

use super::audits::Run;
use super::compared::{Compared, OfScene};
use super::layouts::{Dataset, Scene};
use super::missing::{elsewhere, from_layout};
use super::request::Request;
use crate::Error;

/// File name of the numbers as JSON.
pub const FIGURES: &str = "paper.json";
/// File name of the numbers as CSV.
pub const TABLE: &str = "paper.csv";

/// The paper's tables beside ours.
#[derive(Clone, Debug)]
pub struct Reproduction {
    /// The dataset.
    pub dataset: Dataset,
    /// Every wanted number, by table.
    pub compared: Vec<Compared>,
    /// Pages of the audits of scenes.
    pub pages: Vec<PathBuf>,
    /// Missing data for complete tables, one line each.
    pub missing: Vec<String>,
    /// Tables that other commands reproduce, one line each.
    pub elsewhere: Vec<&'static str>,
    /// Audits and photos that failed, one line each.
    pub failed: Vec<String>,
    options: Value,
}

/// A table as text.
#[derive(Clone, Debug, PartialEq)]
pub struct Sheet {
    /// The title.
    pub title: String,
    /// Cells; the first row contains the column heads.
    pub rows: Vec<Vec<String>>,
}

impl Reproduction {
    pub(super) fn new(request: &Request<'_>, scenes: &[Scene], run: Run<'_>) -> Self {
        let mut missing = from_layout(request, scenes);
        missing.extend(run.missing);
        let (audits, pages): (Vec<OfScene>, Vec<PathBuf>) = run.done.into_iter().unzip();
        let compared = request.numbers().into_iter().map(|n| Compared::new(n, &audits)).collect();
        Self {
            dataset: request.dataset,
            compared,
            pages,
            missing,
            elsewhere: elsewhere(request.dataset),
            failed: run.failed,
            options: json!({
                "parts": request.parts.iter().map(|part| part.name()).collect::<Vec<_>>(),
                "scenes": scenes.iter().map(|scene| scene.name.as_str()).collect::<Vec<_>>(),
                "images": request.images,
                "max_points": request.max_points,
                "scale": request.scale,
                "seed": request.seed,
            }),
        }
    }

    /// Writes both files, or none.
    pub(super) fn write(&self, mut out: OutputSet) -> Result<(), Error> {
        let json = serde_json::to_string_pretty(&self.json())? + "\n";
        for (name, kind, text) in
            [(FIGURES, Kind::AuditJson, json), (TABLE, Kind::Table, self.csv())]
        {
            let staged = out.stage(name, kind)?;
            write_file(&staged, Access::Usual, |w| w.write_all(text.as_bytes()))?;
        }
        Ok(out.commit()?)
    }

    /// Returns the content of `paper.json`; the same files, options and seed give the same content.
    pub fn json(&self) -> Value {
        let number = |one: &Compared| {
            let Printed { table, dim, features, scheme, points, measured, value } = one.printed;
            let (neighbors, inlier_ratio) = points_of(points);
            let by_scene =
                one.by_scene.iter().map(|(name, &found)| (name.clone(), json!(round(found))));
            json!({
                "table": table,
                "dimensions": dim,
                "features": features,
                "scheme": scheme,
                "neighbors": neighbors,
                "inlier_ratio": inlier_ratio,
                "measure": measure(measured, dim),
                "published": value,
                "ours": one.ours().map(round),
                "by_scene": by_scene.collect::<serde_json::Map<_, _>>(),
            })
        };
        json!({
            "unlift": env!("CARGO_PKG_VERSION"),
            "schema": 1,
            "paper": ATTRIBUTION,
            "dataset": self.dataset.published(),
            "options": self.options,
            "numbers": self.compared.iter().map(number).collect::<Vec<_>>(),
            "missing": self.missing,
            "elsewhere": self.elsewhere,
            "failed": self.failed,
        })
    }

    /// Returns the content of `paper.csv`.
    pub fn csv(&self) -> String {
        let mut text = "scheme,neighbors,oracle_noise,inlier_ratio,table,dimensions,features,measure,published,ours,\
                        scenes\n"
            .to_owned();
        for one in &self.compared {
            let Printed { table, dim, features, scheme, points, measured, value } = one.printed;
            let (neighbors, ratio) = points_of(points);
            let noise = if neighbors == "oracle" { "uniform" } else { "" };
            let ratio = ratio.map_or(String::new(), |ratio| ratio.to_string());
            let ours = one.ours().map_or(String::new(), |ours| round(ours).to_string());
            let (measure, n) = (measure(measured, dim), one.by_scene.len());
            text.push_str(&format!(
                "{scheme},{neighbors},{noise},{ratio},{table},{dim},{features},{measure},{value},{ours},{n}\n"
            ));
        }
        text
    }

    /// Returns the tables with at least one number of ours: a row per inlier ratio, a column per
    /// scheme; in each cell our number, and the paper's in brackets.
    pub fn sheets(&self) -> Vec<Sheet> {
        let mut sheets = Vec::new();
        for of_table in self.compared.chunk_by(|a, b| a.printed.table == b.printed.table) {
            for features in ["sift", "superpoint"] {
                for is_picture in [false, true] {
                    let fits = |one: &&Compared| {
                        let is_within = matches!(one.printed.measured, Measured::Within(_));
                        one.printed.features == features && is_within != is_picture
                    };
                    let numbers: Vec<&Compared> = of_table.iter().filter(fits).collect();
                    if numbers.iter().any(|one| one.ours().is_some()) {
                        sheets.push(self.sheet(&numbers));
                    }
                }
            }
        }
        sheets
    }

    fn sheet(&self, numbers: &[&Compared]) -> Sheet {
        let (mut schemes, mut points, mut measures) = (Vec::new(), Vec::new(), Vec::new());
        for one in numbers {
            if one.printed.scheme != "none" && !schemes.contains(&one.printed.scheme) {
                schemes.push(one.printed.scheme);
            }
            if !points.contains(&one.printed.points) {
                points.push(one.printed.points);
            }
            if !measures.contains(&one.printed.measured) {
                measures.push(one.printed.measured);
            }
        }
        let mut rows =
            vec![["right"].into_iter().chain(schemes.iter().copied()).map(str::to_owned).collect()];
        for of in points {
            let cell = |scheme: &&str| {
                let fits = |one: &&&Compared| {
                    let known = of == Points::Originals || one.printed.scheme == *scheme;
                    known && one.printed.points == of
                };
                cell(&numbers.iter().filter(fits).copied().collect::<Vec<_>>(), &measures)
            };
            let cells = schemes.iter().map(cell);
            rows.push([row_name(of)].into_iter().chain(cells).collect());
        }
        let first = &numbers[0].printed;
        let n = numbers.iter().map(|one| one.by_scene.len()).max().unwrap_or(0);
        let of = self.dataset.scenes().len();
        let what = if first.dim == 3 { "maps" } else { "images" };
        let measures: Vec<String> = measures.iter().map(|m| measure(*m, first.dim)).collect();
        let features = if first.features == "sift" { "SIFT" } else { "SuperPoint" };
        let title = format!(
            "table {}: {what} of {}, {features}: {}; mean of {n} of {of} scenes, in brackets the paper's",
            first.table,
            self.dataset.published(),
            measures.join(" / "),
        );
        Sheet { title, rows }
    }
}

/// Formats our numbers and, in brackets, the paper's, one for every measure.
fn cell(numbers: &[&Compared], measures: &[Measured]) -> String {
    let of = |value: &dyn Fn(&Compared) -> Option<f64>| {
        let one = |measured: &Measured| {
            let found = numbers.iter().find(|one| one.printed.measured == *measured);
            let digits = if matches!(measured, Measured::Ssim | Measured::Lpips) { 2 } else { 1 };
            let value = found.and_then(|one| value(one));
            value.map_or("-".to_owned(), |value| format!("{value:.digits$}"))
        };
        measures.iter().map(one).collect::<Vec<_>>().join("/")
    };
    if numbers.is_empty() {
        return "-".to_owned();
    }
    format!("{} [{}]", of(&Compared::ours), of(&|one| Some(one.printed.value)))
}

fn row_name(points: Points) -> String {
    match points {
        Points::Oracle(ratio) => format!("{} %", 100.0 * ratio),
        Points::Estimated => "estimated".to_owned(),
        Points::Originals => "originals".to_owned(),
    }
}

fn points_of(points: Points) -> (&'static str, Option<f64>) {
    match points {
        Points::Oracle(ratio) => ("oracle", Some(ratio)),
        Points::Estimated => ("estimated", None),
        Points::Originals => ("none", None),
    }
}

fn measure(measured: Measured, dim: usize) -> String {
    match measured {
        Measured::Within(threshold) if dim == 3 => format!("percent within {threshold:.2} m"),
        Measured::Within(threshold) => format!("percent within {threshold} px"),
        Measured::Ssim => "SSIM".to_owned(),
        Measured::Psnr => "PSNR".to_owned(),
        Measured::Lpips => "LPIPS".to_owned(),
    }
}

/// Rounds to four decimal places; scenes differ by far more.
fn round(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}
