//! The paper's tables on its own datasets: our numbers beside the published ones.
//!
//! ```text
//! layouts::open ──> Scene .. ──> audits (maps, images) ──> Compared .. ──> sheets, paper.json, paper.csv
//! ```
//!
//! Every scene is audited by [`crate::maps`] and [`crate::images::audit`] like any other map or
//! folder of photos. The comparison uses the rows of their documents.

mod audits;
mod compared;
mod layouts;
mod missing;
mod request;
mod result;
mod scale;

use unlift_io::atomic::{Access, Kind, OutputSet};

pub use compared::Compared;
pub use layouts::{Dataset, Poses, Scene};
pub use request::{Part, Request};
pub use result::{FIGURES, Reproduction, Sheet, TABLE};

use crate::{Error, refused};

/// Audits every existing scene and compares the results with the paper's tables. Scenes that cannot
/// be audited are reported and skipped. Without a single audit nothing is written.
///
/// # Errors
/// If there is no scene, a list of the dataset is malformed, the folder cannot be written, or the
/// progress of `begin` stops the audit.
pub fn reproduce(request: &Request<'_>) -> Result<Reproduction, Error> {
    let mut scenes = layouts::open(request.dataset, request.root, request.models)?;
    chosen(request, &mut scenes)?;
    let first = [(FIGURES, Kind::AuditJson), (TABLE, Kind::Table)];
    let out = OutputSet::create(request.out, request.rules(), Access::Usual, &first);
    let out = out.map_err(refused)?;
    let mut run = audits::Run::new(request);
    for scene in &scenes {
        run.audit(scene)?;
    }
    let result = Reproduction::new(request, &scenes, run);
    if !result.pages.is_empty() {
        result.write(out)?;
    }
    Ok(result)
}

fn chosen(request: &Request<'_>, scenes: &mut Vec<Scene>) -> Result<(), Error> {
    for name in &request.scenes {
        let known = request.dataset.scenes();
        if !known.contains(&name.as_str()) {
            let known = known.join(", ");
            return Err(Error::request(format!(
                "--scenes: expected some of {known}, found {name}"
            )));
        }
        if !scenes.iter().any(|scene| scene.name == *name) {
            let there: Vec<&str> = scenes.iter().map(|scene| scene.name.as_str()).collect();
            let (root, there) = (request.root, there.join(", "));
            return Err(unlift_io::Error::new(root, "", format!("a folder {name}"), there).into());
        }
    }
    if !request.scenes.is_empty() {
        scenes.retain(|scene| request.scenes.contains(&scene.name));
    }
    Ok(())
}
