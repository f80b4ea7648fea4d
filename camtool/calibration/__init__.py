"""What coupons say of a machine: drawings, measurements, and the numbers they give."""
