//! A sweep as an array of tasks of a cluster.

use crate::cli::SweepArgs;
use crate::shell::quoted_path;
use crate::verbs::files::absolute;
use std::path::Path;

/// A script whose task k trains run k; the same command without `--only` then writes the table.
pub(super) fn slurm(program: &Path, args: &SweepArgs, count: usize) -> String {
    let program = quoted_path(program);
    let (plan, out) = (absolute(&args.plan), absolute(&args.out));
    let (plan, out) = (quoted_path(&plan), quoted_path(&out));
    format!(
        "#!/bin/sh\n#SBATCH --job-name=refraxel-sweep\n#SBATCH --array=0-{last}\n#SBATCH --requeue\n\
         # A task that was lost is started again and goes on from its last checkpoint. When all are done,\n\
         #   {program} sweep {plan} --out {out}\n# writes the table and the page.\n\
         exec {program} sweep {plan} --out {out} --only \"$SLURM_ARRAY_TASK_ID\" \\\n    \
         --threads \"${{SLURM_CPUS_PER_TASK:-1}}\"\n",
        last = count.saturating_sub(1),
    )
}
