//! Writes the paper's figures, data and claims: `cargo run --release -p cdpr-paper --example figures -- DIR`.

use std::path::PathBuf;

fn main() -> Result<(), cdpr_paper::PaperError> {
    let folder = std::env::args().nth(1).map_or_else(|| PathBuf::from("paper-out"), PathBuf::from);
    for claim in cdpr_paper::write(&folder, |what| eprintln!("{what}"))? {
        println!("{}: {}", claim.verdict, claim.statement);
    }
    Ok(())
}
