//! What steers a build of the tree for the batch kernels.

use crate::engine::{self, Loaded};
use crate::output::usage;
use crate::saved;
use ropewalk::Ray;
use ropewalk::build::{BuildSettings, CostChoice, Preset, RaySample};
use ropewalk::kernel::BatchCaster;
use ropewalk_workload::{BenchHit, Generator, Kind, Sizes};

/// Options that the commands share.
#[derive(clap::Args)]
pub struct Controls {
    /// How to build: fast, balanced, best or compact; balanced if not given
    #[arg(long)]
    preset: Option<String>,
    /// What the build minimises; surface_area if not given, an unknown name lists them all
    #[arg(long, value_name = "NAME")]
    cost_model: Option<String>,
    /// Workloads, comma-separated, whose rays from the scene's view steer the build
    #[arg(long, value_name = "WORKLOADS", value_delimiter = ',')]
    rays: Vec<String>,
}

impl Controls {
    /// The first option given, which a scene that is not built cannot take.
    pub fn given(&self) -> Option<&'static str> {
        let options = [
            (self.preset.is_some(), "--preset"),
            (self.cost_model.is_some(), "--cost-model"),
            (!self.rays.is_empty(), "--rays"),
        ];
        options.into_iter().find(|(given, _)| *given).map(|(_, name)| name)
    }

    /// The preset and the cost model.
    pub fn names(&self) -> anyhow::Result<(Preset, CostChoice)> {
        let preset = self.preset.as_deref().unwrap_or(Preset::Balanced.name());
        let preset = named(&Preset::ALL, Preset::name, preset, "preset")?;
        let model = self.cost_model.as_deref().unwrap_or(CostChoice::default().name());
        let model = named(&CostChoice::ALL, CostChoice::name, model, "cost model")?;
        if !self.rays.is_empty() && model != CostChoice::SurfaceArea {
            return Err(usage(format!(
                "--rays steers builds by the surface area alone, not by {}",
                model.name()
            )));
        }
        Ok((preset, model))
    }

    /// The settings of a build over a scene; the sample is drawn from a picture of `side` pixels a side, with other
    /// random numbers than the workloads of `bench` have.
    pub fn settings(
        &self,
        loaded: &Loaded,
        side: usize,
        threads: usize,
    ) -> anyhow::Result<BuildSettings> {
        let (preset, model) = self.names()?;
        let kinds = workloads(&self.rays)?;
        let settings = BuildSettings { threads, ..BuildSettings::preset(preset) };
        if kinds.is_empty() {
            return Ok(model.applied(settings));
        }
        let geometry = &loaded.geometry;
        let quick = BuildSettings { threads, ..BuildSettings::preset(Preset::Fast) };
        let (tree, _) = engine::build_wide(geometry, &quick)?;
        let caster = BatchCaster::new(&tree, geometry);
        let trace = |rays: &[Ray], out: &mut [BenchHit]| {
            let hits = caster.closest_hit(rays);
            for (out, (t, prim)) in out.iter_mut().zip(hits.t.into_iter().zip(hits.prim_id)) {
                *out = BenchHit { t, prim };
            }
        };
        let (view, sizes) = (saved::view_of(loaded), Sizes::of_side(side));
        let generator = Generator::new(&**geometry, &view, sizes, &trace).with_seed(1);
        let rays: Vec<Ray> = kinds.into_iter().flat_map(|k| generator.workload(k).rays).collect();
        Ok(BuildSettings { rays: RaySample::new(&rays), ..settings })
    }
}

/// The workloads of these names; all but the one without rays are known.
pub fn workloads(names: &[String]) -> anyhow::Result<Vec<Kind>> {
    let known: Vec<Kind> = Kind::ALL.into_iter().filter(|&k| k != Kind::Build).collect();
    names.iter().map(|name| named(&known, Kind::name, name, "workload")).collect()
}

/// The value called `name`, or a usage error that lists them all.
pub fn named<T: Copy>(
    all: &[T],
    name_of: fn(T) -> &'static str,
    name: &str,
    what: &str,
) -> anyhow::Result<T> {
    all.iter().copied().find(|&x| name_of(x) == name).ok_or_else(|| {
        let names: Vec<_> = all.iter().map(|&x| name_of(x)).collect();
        usage(format!("no {what} is called '{name}'; there are: {}", names.join(", ")))
    })
}
