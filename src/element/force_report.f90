!> What an evaluation of the forces finds beside them.
module force_report
  use kinds, only: wp
  implicit none
  private

  public :: merge_reports

  !> What one force evaluation reports beside the forces.
  type, public :: force_report_t
    real(wp) :: internal_work = 0.0_wp      !! stress power times dt
    real(wp) :: viscous_work = 0.0_wp
    real(wp) :: largest_rate = 0.0_wp       !! largest |J^-1|^2 (Frobenius), [1/length^2]
    real(wp) :: smallest_det = huge(1.0_wp) !! smallest jacobian determinant
    integer :: failed_block = huge(1)       !! lowest block whose law failed or that turned over
    integer :: failed_part = 1              !! the part of the body it belongs to
  end type force_report_t

contains

  !> Add a report to another one.
  pure subroutine merge_reports(report, other)
    type(force_report_t), intent(inout) :: report
    type(force_report_t), intent(in) :: other

    report%internal_work = report%internal_work + other%internal_work
    report%viscous_work = report%viscous_work + other%viscous_work
    report%largest_rate = max(report%largest_rate, other%largest_rate)
    report%smallest_det = min(report%smallest_det, other%smallest_det)
  end subroutine merge_reports

end module force_report
