//! How the command line chooses tensions.

use cdpr::inverse::distribution::{Bounds, Distribution, Objective, Redundancy};
use cdpr::parameters::Parameters;
use cdpr_tension_qp::QuadraticProgramme;
use clap::ValueEnum;

use crate::failure::BadInput;
use crate::number;

/// Bounds, objective and solver of the tension distribution.
#[derive(clap::Args)]
pub(crate) struct Choice {
    /// Smallest tension of a cable in N; by default 0.4 N for each kg of the platform, 1000 N for the default model's
    #[arg(long, value_name = "N", value_parser = number::finite, allow_negative_numbers = true)]
    tension_min: Option<f64>,
    /// Largest tension of a cable in N; by default 20 N for each kg of the platform, 50000 N for the default model's
    #[arg(long, value_name = "N", value_parser = number::finite, allow_negative_numbers = true)]
    tension_max: Option<f64>,
    /// What is made smallest within the bounds
    #[arg(long, value_enum, default_value_t = Goal::MidTension)]
    objective: Goal,
    /// Exponent of `p-norm`
    #[arg(long, value_name = "P", default_value = "6", value_parser = exponent, allow_negative_numbers = true)]
    exponent: f64,
    /// Round the kinks of `minimum-norm` over about so many N of tension
    #[arg(long, value_name = "N", value_parser = number::positive)]
    smooth: Option<f64>,
    /// How it is solved
    #[arg(long, value_enum, default_value_t = Solver::ClosedForm)]
    solver: Solver,
}

#[derive(Clone, Copy, ValueEnum)]
enum Goal {
    /// Sum of squares of the distance from the mean of the bounds
    MidTension,
    /// Sum of squares of the tensions
    MinimumNorm,
    /// Sum of powers of the distance from the mean of the bounds
    PNorm,
    /// Closeness to any bound
    AnalyticCentre,
}

#[derive(Clone, Copy, ValueEnum)]
enum Solver {
    /// In closed form
    ClosedForm,
    /// As a quadratic programme (mid-tension and minimum-norm)
    QuadraticProgramme,
}

fn exponent(text: &str) -> Result<f64, String> {
    match number::finite(text)? {
        p if (1.5..=20.0).contains(&p) => Ok(p),
        p => Err(format!("{p} is not from 1.5 to 20")),
    }
}

impl Choice {
    /// The distribution, and whatever solves it; nearest to `pretension` (N) where there is one, whatever the objective.
    pub(crate) fn resolve(
        &self,
        robot: &Parameters,
        pretension: Option<f64>,
    ) -> Result<(Distribution, Box<dyn Redundancy>), BadInput> {
        let usual = Bounds::of_mass(robot.platform_mass);
        let [lower, upper] = [self.tension_min.unwrap_or(usual.lower()), self.tension_max.unwrap_or(usual.upper())];
        let bounds = Bounds::new(lower, upper).map_err(|error| {
            BadInput(
                error.to_string().replace("`tension_min`", "--tension-min").replace("`tension_max`", "--tension-max"),
            )
        })?;
        if let Some(pretension) = pretension.filter(|pretension| !(lower..=upper).contains(pretension)) {
            return Err(BadInput(format!(
                "--pretension is {pretension}, expected from {lower} to {upper} N; --tension-min and --tension-max set these bounds"
            )));
        }
        let own = match self.objective {
            Goal::MinimumNorm => self.smooth.map_or(Objective::MinimumNorm, Objective::SmoothNorm),
            _ if self.smooth.is_some() => {
                return Err(BadInput("--smooth goes with --objective minimum-norm, which has kinks".to_owned()));
            }
            Goal::MidTension => Objective::MidTension,
            Goal::PNorm => Objective::PNorm(self.exponent),
            Goal::AnalyticCentre => Objective::AnalyticCentre,
        };
        let objective = pretension.map_or(own, Objective::Near);
        let distribution = Distribution { objective, bounds };
        match self.solver {
            Solver::ClosedForm => Ok((distribution, Box::new(distribution))),
            Solver::QuadraticProgramme => match objective {
                Objective::MinimumNorm | Objective::MidTension | Objective::Near(_) => {
                    Ok((distribution, Box::new(QuadraticProgramme { distribution })))
                }
                Objective::PNorm(_) | Objective::AnalyticCentre | Objective::SmoothNorm(_) => Err(BadInput(
                    "--solver quadratic-programme takes --objective mid-tension or minimum-norm, which are quadratic, and no \
                     --smooth"
                        .to_owned(),
                )),
            },
        }
    }
}
