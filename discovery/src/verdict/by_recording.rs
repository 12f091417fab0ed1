//! Which recordings a model explains, each by itself. Forces at random that one of them needs make the states less well known in all, and leave
//! a gap in those as well in which nothing is missing.

use crate::data::Trial;
use crate::filter::error::FitError;
use crate::filter::estimate::Fit;
use crate::strategy::context::Context;
use crate::strategy::fitted::Fitted;
use crate::verdict::attainable;
use crate::verdict::gap::{gap, predict};

/// How far free runs miss one recording.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct OfRecording {
    pub(crate) name: String,
    pub(crate) holdout: bool,
    /// In multiples of what a model without fault would leave.
    pub(crate) gap: f64,
}

/// How far free runs over the main horizon miss each recording, where the sizes of forces at random are its own; those along which the model cannot
/// be simulated so are left out, with a remark, and those along which it does not settle.
pub(crate) fn by_recording(context: &Context<'_>, fitted: &Fitted) -> Result<Vec<OfRecording>, FitError> {
    let evidence = context.evidence;
    let sets = [(&fitted.train, &evidence.train, false), (&fitted.holdout, &evidence.holdout, true)];
    let mut out = Vec::new();
    for (fit, trials, holdout) in sets {
        for (at, trial) in trials.iter().enumerate() {
            let missed = fit.of_one(trials, at).and_then(|fit| missed(context, fit, trial, fitted));
            let left_out = format!("The model does not go with {} by itself", trial.name);
            if let Some(gap) = context.journal.or_remark(&left_out, missed)?.flatten() {
                out.push(OfRecording { name: trial.name.clone(), holdout, gap });
            }
        }
    }
    Ok(out)
}

fn missed(context: &Context<'_>, mut fit: Fit, trial: &Trial, fitted: &Fitted) -> Result<Option<f64>, FitError> {
    let (trials, horizon) = (std::slice::from_ref(trial), context.reaches.main.horizon);
    // What the trajectory took for forces at random it gives back.
    let mut stays = false;
    for _ in 0..2 {
        // What the instruments do was found in all.
        match fitted.instruments {
            Some(_) => fit.fit_latents(trials),
            None => fit.fit_randomness(trials, &context.evidence.noise, true),
        }
        stays = fit.settle(trials, context.policy.held_out_moves)?;
    }
    if !stays {
        return Ok(None);
    }
    let predictions = predict(&fit, trials, horizon);
    Ok(Some(match &fitted.instruments {
        Some(randomness) => gap(trials, &predictions, &fit.spread(trials, randomness, horizon)).total(),
        None => {
            let noise = &fitted.train.randomness.noise;
            gap(trials, &predictions, noise).total() / attainable(&fit, trials, noise, horizon)
        }
    }))
}

#[cfg(test)]
mod tests {
    use cdpr::model_file::Model;

    use super::*;
    use crate::data::recording::record;
    use crate::filter::estimate::noise_of_data;
    use crate::strategy::fitted::Evidence;
    use crate::strategy::fixture::effect;

    /// Wind in one of two recordings that were fitted left three times the noise in the one that was held out, and nobody knew where it was.
    #[test]
    fn the_recording_that_differs_is_told_from_those_that_do_not() {
        let wind = [effect("steady_wind", None, &[120.0, 60.0])];
        let evidence = {
            let (train, holdout) = (vec![record(&wind, 60.0, 31), record(&[], 60.0, 32)], vec![record(&[], 60.0, 33)]);
            let noise = noise_of_data(&train);
            Evidence::new(train, holdout, noise)
        };
        let begun = Context::begin(&evidence, &Model::default(), 0..0, &|_, _| {});
        let (context, base) = begun.expect("a fit");
        assert!(base.gap[0] > 1.5, "{:?}", base.gap);
        let found = by_recording(&context, &base).expect("fits");
        let gaps: Vec<f64> = found.iter().map(|of| of.gap).collect();
        assert!(gaps.len() == 3 && gaps[0] > 5.0 && gaps[1] < 1.2 && gaps[2] < 1.2, "{gaps:?}");
        assert_eq!(found.iter().map(|of| of.holdout).collect::<Vec<_>>(), [false, false, true]);
    }
}
