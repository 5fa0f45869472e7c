//! Lists what is missing for a table: one line each, with the web site that publishes it.

use unlift_report::printed::{Printed, printed};

use super::layouts::{Dataset, Scene, looked_in};
use super::request::{Part, Request};

/// Names the tables of the numbers for which `is_about` is true: `table 1`, `tables 3, 4`.
pub fn tables(dataset: Dataset, is_about: impl Fn(&Printed) -> bool) -> String {
    let numbers = printed(dataset.published());
    let mut tables: Vec<u8> =
        numbers.iter().filter(|number| is_about(number)).map(|number| number.table).collect();
    tables.dedup();
    let word = if tables.len() == 1 { "table" } else { "tables" };
    let tables: Vec<String> = tables.iter().map(u8::to_string).collect();
    format!("{word} {}", tables.join(", "))
}

/// Names the wanted tables of a dataset's maps or images, with these features.
pub fn tables_of(request: &Request<'_>, dim: usize, features: &str) -> String {
    let wanted = |number: &Printed| {
        (number.dim, number.features) == (dim, features)
            && Part::of(number).iter().all(|&part| request.wants(part))
    };
    tables(request.dataset, wanted)
}

/// Lists what is missing according to the folders alone.
pub fn from_layout(request: &Request<'_>, scenes: &[Scene]) -> Vec<String> {
    let (dataset, mut lines) = (request.dataset, Vec::new());
    let there = |name: &&&str| scenes.iter().any(|scene| scene.name == **name);
    let absent: Vec<&str> = dataset.scenes().iter().filter(|name| !there(name)).copied().collect();
    if !absent.is_empty() && request.scenes.is_empty() {
        let (n, of, names) = (absent.len(), dataset.scenes().len(), absent.join(", "));
        lines.push(format!("all tables: {n} of {of} scenes ({names}): {}", dataset.owner()));
    }
    let of_images = [Part::Images, Part::Estimated, Part::Pictures];
    if of_images.iter().any(|&part| request.wants(part)) {
        let tables = tables_of(request, 2, "sift");
        for scene in scenes {
            if let Some(lacking) = &scene.lacking {
                let name = &scene.name;
                lines.push(format!("{tables}: photos of {name}: {lacking}: {}", dataset.owner()));
            }
        }
    }
    if request.wants(Part::Maps) || request.wants(Part::Pictures) {
        let without = scenes.iter().filter(|scene| scene.map.is_none());
        let names: Vec<&str> = without.map(|scene| scene.name.as_str()).collect();
        if !names.is_empty() {
            let (tables, names) = (tables_of(request, 3, "sift"), names.join(", "));
            let looked = looked_in(dataset, request.models);
            lines.push(format!(
                "{tables}: maps of {names}, looked for in {looked}: {}",
                dataset.maps()
            ));
        }
    }
    lines
}

/// Lists the results that the paper prints for this dataset and this command does not compare.
pub fn elsewhere(dataset: Dataset) -> Vec<&'static str> {
    match dataset {
        Dataset::SevenScenes => vec![
            "table 7, SuperPoint: unlift audit map, with a map that hloc makes of SuperPoint features",
            "table 14 (seconds): cargo bench -p unlift --bench recover -- points=700000 schemes=ppl",
            "table 15 (objects): objects_found in the rows of audits with pictures",
        ],
        Dataset::TwelveScenes => vec![
            "table 13 (density attacks): unlift audit map --solver density --thresholds 0.05,0.10,0.25",
        ],
        Dataset::Cambridge => Vec::new(),
    }
}
