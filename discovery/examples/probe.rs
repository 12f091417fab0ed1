//! Probe.
use std::path::Path;
fn main() {
    for dir in std::env::args().skip(1) {
        let text = std::fs::read_to_string(format!("{dir}/model.toml")).unwrap_or_default();
        let model = cdpr::model_file::Model::from_toml(&text).unwrap();
        let map = cdpr_discovery::data::ColumnMap::default();
        let read = |names: &[&str]| {
            names
                .iter()
                .map(|f| format!("{dir}/{f}"))
                .filter(|f| Path::new(f).exists())
                .map(|f| cdpr_discovery::data::read_trial(Path::new(&f), &map).unwrap())
                .collect::<Vec<_>>()
        };
        let d =
            cdpr_discovery::discover(&model, read(&["train1.csv", "train2.csv"]), read(&["holdout.csv"]), &|_m, _f| {})
                .unwrap();
        println!("== {dir}: {:?} in {:.1}s", d.verdict, d.seconds);
        for s in &d.steps {
            println!(
                "   step {} {} {:?} {:?} {:.1} {}",
                s.outcome, s.effect.id, s.effect.cable, s.effect.values, s.delta_bic, s.reason
            );
        }
        for f in d.effects.iter().chain(&d.terms) {
            println!(
                "   FOUND {} {:?} {:?} se {:?} {:?} dBIC {:.1} without {:?}",
                f.effect.id,
                f.effect.cable,
                f.effect.values,
                f.standard_error,
                f.effect.expression,
                f.delta_bic,
                f.holdout_gap_without
            );
            for a in &f.alternatives {
                println!(
                    "        alt {} {:?} {:?} {:.1} {}",
                    a.effect.id, a.effect.cable, a.effect.values, a.delta_bic, a.indistinguishable
                );
            }
        }
        for h in &d.horizons {
            println!(
                "   gap {}: train {:.3}->{:.3} holdout {:.3}->{:.3}",
                h.horizon, h.train.before, h.train.after, h.holdout.before, h.holdout.after
            );
        }
        println!("   remainder {:?} {:?} remarks {:?}", d.remainder_force, d.remainder_torque, d.remarks);
    }
}
