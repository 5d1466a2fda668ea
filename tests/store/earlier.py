"""The header of a trials table written before later columns were added."""

TRIALS_HEADER = (
    "study,participant,session,simulated,pilot,trial,attempt,block,phase,part,index,of,code,"
    "trial_started_at,trial_started_s,outcome,duration_s,targets_reached,targets,ticks,tick_rate_hz,"
    "lateness_p99_ms,worst_gap_ms,overruns,samples_dropped,path_length_m,mean_speed_mps,force_mean_n,"
    "force_peak_n,limiter_slope,limiter_non_finite,limiter_energy,limiter_norm,limiter_slew,limiter_fade,"
    "limiter_stale,limiter_glitch,limiter_stop,frames,frames_late,delay_error_mean_ms,delay_error_p95_ms,"
    "delay_error_max_ms,worst_frame_gap_ms,valid,recording,recording_frames,samples_recorded,"
    "samples_unrecorded,marked,notes"
)
