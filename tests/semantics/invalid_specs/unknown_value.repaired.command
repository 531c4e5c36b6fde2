simulate ev_driveline tip_out 'k_hs=5000 N*m/rad'
