"""The slider-crank of chapter 4, as equations by hand that its system file is compared with."""
