//! Probe.
use std::path::Path;
fn main() {
    let dir = std::env::args().nth(1).unwrap();
    let text = std::fs::read_to_string(format!("{dir}/model.toml")).unwrap_or_default();
    let model = cdpr::model_file::Model::from_toml(&text).unwrap();
    let map = cdpr_discovery::data::ColumnMap::default();
    let trials = ["train1.csv", "train2.csv"]
        .iter()
        .map(|f| format!("{dir}/{f}"))
        .filter(|f| Path::new(f).exists())
        .map(|f| cdpr_discovery::data::read_trial(Path::new(&f), &map).unwrap())
        .collect();
    cdpr_discovery::probe(&model, trials);
}
