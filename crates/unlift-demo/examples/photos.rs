//! Writes the photos of the room of a seed: `cargo run --release -p unlift-demo --example photos -- FOLDER [SEED]`.

use std::error::Error;
use std::path::PathBuf;
use std::time::Instant;

use unlift_features::preview::jpeg_of;

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let folder = PathBuf::from(args.next().ok_or("expected a folder")?);
    let seed = args.next().map_or(Ok(0), |seed| seed.parse())?;
    let started = Instant::now();
    let mapped = unlift_demo::room(seed)?;
    let seconds = started.elapsed().as_secs_f64();
    std::fs::create_dir_all(&folder)?;
    for photo in &mapped.photos {
        std::fs::write(folder.join(&photo.name), jpeg_of(&photo.image, unlift_demo::SIZE[0])?)?;
    }
    println!("{} photos, {} points, {seconds:.1} s", mapped.photos.len(), mapped.points.len());
    Ok(())
}
