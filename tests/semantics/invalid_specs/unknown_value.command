simulate ev_driveline tip_out 'k_h=5000 N*m/rad'
