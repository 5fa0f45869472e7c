//! Measures inlier ratios of descriptors in photos: `descriptors_tell FOLDER [--superpoint]`.
//!
//! Prints the rows of a table in docs/benchmarks.md: the share of the first 20 entries of lists
//! that are among the 20 nearest keypoints, for each kind of features and each source.

use std::error::Error;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use unlift::neighbors::oracle::{self, TrueNeighbors};
use unlift::neighbors::{Neighborhoods, Overlap, Similarity, Source};
use unlift::obfuscate::{obfuscate, olc};
use unlift::protected::{inner, unit_rows};
use unlift::released::Released;
use unlift::seed::Key;
use unlift::truth::Original;
use unlift::{About, Descriptors, PointSet, RecordId, RowOrder, Unit};
use unlift_vision::features::{Extraction, Extractor, Photo};
use unlift_vision::network::Learned;

const K: usize = 20;

/// Number of keypoints of a photo and, per column, the inlier ratio, if there is one.
type Shares = (usize, [Option<f64>; COLUMNS.len()]);

/// The columns: plain cosines, then the sources of unlift.
const COLUMNS: [&str; 4] = ["cosines alone", "`similarity`", "`overlap`", "`learned`"];

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().ok_or("expected a folder of photos")?;
    let mut photos: Vec<PathBuf> = std::fs::read_dir(folder)?
        .map(|entry| Ok(entry?.path()))
        .collect::<std::io::Result<_>>()?;
    photos.sort();
    if photos.is_empty() {
        return Err("expected photos in the folder, found none".into());
    }
    let mut kinds = vec![
        ("SIFT", Extraction::SIFT),
        ("ALIKED, the best 2,048", Extraction { min_score: 0.02, ..Extraction::ALIKED }),
        ("ALIKED, score above 0.2", Extraction::ALIKED),
    ];
    if arguments.any(|argument| argument == "--superpoint") {
        kinds.push(("SuperPoint", Extraction::SUPERPOINT));
    }
    println!("| features | keypoints | {} |", COLUMNS.join(" | "));
    println!("| --- | --- |{}", " --- |".repeat(COLUMNS.len()));
    for (name, extraction) in kinds {
        let extractor = Extractor::try_new(&extraction)?;
        let found: Vec<Option<Shares>> = photos
            .par_iter()
            .map(|photo| named(&extractor, photo).map_err(|error| error.to_string()))
            .collect::<Result<_, String>>()?;
        let found: Vec<_> = found.into_iter().flatten().collect();
        let keypoints: usize = found.iter().map(|(n, _)| n).sum();
        let share = |column: usize| {
            let hits =
                found.iter().map(|(n, shares)| shares[column].map(|share| share * *n as f64));
            let hits: Option<f64> = hits.sum();
            hits.map_or("-".to_owned(), |hits| format!("{:.1} %", 100.0 * hits / keypoints as f64))
        };
        let shares: Vec<String> = (0..COLUMNS.len()).map(share).collect();
        println!("| {name} | {keypoints} | {} |", shares.join(" | "));
    }
    Ok(())
}

/// Measures the inlier ratios of a photo; `None` if it has too few keypoints.
fn named(extractor: &Extractor, photo: &Path) -> Result<Option<Shares>, unlift::Error> {
    let Photo { keypoints: places, descriptors, dim, .. } = extractor.read(photo)?;
    if places.len() <= K {
        return Ok(None);
    }
    let points = places.iter().map(|at| at.map(f64::from)).collect();
    let original = Original::new(PointSet::try_new(points, Unit::Pixel)?);
    let descriptors = Descriptors::try_new(descriptors, dim)?;
    let key = Key::from_seed(0);
    let (released, secret) = obfuscate(&olc::LINES2D, &original, Some(&descriptors), &key)?;
    let near = TrueNeighbors::new(&oracle::search(&original)?, &secret, K)?;
    let by = |source: &dyn Source<2>| -> Result<Option<f64>, unlift::Error> {
        if source.supports(&released).is_err() {
            return Ok(None);
        }
        Ok(Some(near.measured_inlier_ratio(&source.lists(&released, K, 0)?)))
    };
    let plain = Some(near.measured_inlier_ratio(&cosines(&released)?));
    let shares = [plain, by(&Similarity)?, by(&Overlap)?, by(&Learned)?];
    Ok(Some((places.len(), shares)))
}

/// Lists the records with the largest cosines.
fn cosines(released: &Released<2>) -> Result<Neighborhoods, unlift::Error> {
    let rows: Vec<Vec<f32>> = released.descriptors().into_iter().flat_map(unit_rows).collect();
    let n = rows.len();
    let mut records = Vec::with_capacity(n * K);
    for at in 0..n {
        let others = (0..n).filter(|&other| other != at);
        let scored = others.map(|other| (inner(&rows[at], &rows[other]), other));
        let mut scored: Vec<(f32, usize)> = scored.collect();
        scored.select_nth_unstable_by(K - 1, |a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        records.extend(scored[..K].iter().map(|&(_, other)| RecordId(other as u32)));
    }
    let offsets = (0..=n).map(|at| (at * K) as u64).collect();
    let lists = Neighborhoods::try_new(offsets, records, None, n, 1)?;
    let map = Some(released.fingerprint());
    Ok(lists.with_about(About { map, order: RowOrder::DescriptorRows, ..About::default() }))
}
