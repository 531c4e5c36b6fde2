simulate ev_driveline tip_out 'J_v=100 kg*m^2'
