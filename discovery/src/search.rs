//! The search: one effect after the other, refined, pruned, checked on held-out data.

use std::time::Instant;

use cdpr::effect::EffectSpec;
use cdpr::model_file::Model;

use crate::candidates::{Library, Situation, catalogue};
use crate::clean::remove_outliers;
use crate::data::Trial;
use crate::estimate::*;
use crate::kalman::Forcing;
use crate::regression::{baseline, ladder, levels, rank};
use crate::{gap, signature};

pub(crate) fn library_forcing(fit: &Fit, trials: &[Trial], library: &Library) -> Vec<Forcing> {
    trials
        .iter()
        .enumerate()
        .map(|(t, trial)| {
            let raw = signature::forcing(
                &fit.model,
                &fit.examined,
                &library.variations,
                &fit.linear[t],
                trial,
                &fit.trajectories[t],
                &|| {},
            );
            signature::combine(&raw, &library.columns)
        })
        .collect()
}

#[allow(missing_docs)]
pub fn probe(model: &Model, mut trials: Vec<Trial>) {
    let t0 = Instant::now();
    for t in &mut trials {
        remove_outliers(t);
    }
    let noise = noise_of_data(&trials);
    let r = first_randomness(model, &noise);
    let mut fit = Fit::new(model, &trials, &r, None).unwrap();
    fit.smooth(&trials).unwrap();
    fit.fit_randomness(&trials, &noise, true);
    println!(
        "{:.2}s ml F {:.3} W {:.3} L {:.1}",
        t0.elapsed().as_secs_f64(),
        fit.randomness.force,
        fit.randomness.winch,
        fit.minus_two_log_likelihood(&trials, &fit.randomness)
    );
    for h in [1.0, 5.0, 20.0] {
        let p = gap::predict(&fit, &trials, h);
        println!("gap {h}: {:.3}", gap::gap(&trials, &p, &noise).total());
    }
    for round in 0..4 {
        let situation = Situation::of(&trials);
        let lib = catalogue(&fit.model, &situation);
        let forcing = library_forcing(&fit, &trials, &lib);
        println!("{:.2}s forcing", t0.elapsed().as_secs_f64());
        let lv = levels(&fit, &trials, &forcing, &ladder(&fit.randomness));
        let n: usize = lv[0].normal.count;
        let penalty = (n as f64).ln() + 2.0 * (lib.columns.len() as f64).ln();
        let base = baseline(&lv, &[]);
        println!("{:.2}s levels; base {base:.1} penalty {penalty:.1}", t0.elapsed().as_secs_f64());
        let ranked = rank(&lib, &lv, &[], penalty);
        for s in ranked.iter().take(8) {
            let c = &lib.candidates[s.candidate];
            println!(
                "   {:10.1} lvl {} {:?}",
                s.score - base,
                s.level,
                c.effect(&s.amplitudes).map(|e| (e.id.clone(), e.cable, e.values.clone()))
            );
        }
        let Some(best) = ranked.first() else { break };
        if best.score > base - 10.0 {
            break;
        }
        let effect: EffectSpec = lib.candidates[best.candidate].effect(&best.amplitudes).unwrap();
        let mut model = fit.model.clone();
        model.effects.push(effect);
        let mut next = Fit::new(&model, &trials, &lv[best.level].randomness, Some(&fit)).unwrap();
        let est = refine(&mut next, &trials, &noise, 0, 6).unwrap();
        println!(
            "{:.2}s refined: L {:.1} F {:.3} W {:.3}",
            t0.elapsed().as_secs_f64(),
            next.minus_two_log_likelihood(&trials, &next.randomness),
            next.randomness.force,
            next.randomness.winch
        );
        for (f, se) in est.free.iter().zip(&est.standard_error) {
            let e = &next.model.effects[f.effect];
            println!(
                "     {} {:?} {} = {:.6} +- {:.6} wald {:.1}",
                e.id,
                e.cable,
                e.info().unwrap().parameters[f.parameter].name,
                e.values[f.parameter],
                se,
                est.wald[f.effect]
            );
        }
        for h in [1.0, 5.0, 20.0] {
            let p = gap::predict(&next, &trials, h);
            println!("  gap {h}: {:.4}", gap::gap(&trials, &p, &noise).total());
        }
        fit = next;
        let _ = round;
    }
}
